//! Sweeps of volumes with few different values, without their meshes.

use std::sync::Arc as Shared;

use super::*;
use crate::kernels::Choice;
use random::Random;

#[allow(clippy::duplicate_mod, reason = "as in tests/: each module that draws has its own")]
#[path = "../../tests/random/mod.rs"]
mod random;

#[path = "../../tests/few_values/mod.rs"]
mod few_values;

/// The first so many volumes, and some more: of 6,000, three have batches of events that reach so far that the middle
/// between two of them lies before some event of the first, or after some of the second.
const FIRST: u64 = 300;
const WIDE: [u64; 3] = [277, 4172, 5470];

#[test]
fn the_middle_of_every_piece_is_an_isovalue_at_which_its_component_is() {
    let backend = Backend::choose(Choice::Cpu, None).expect("the processor");
    let parameters = Parameters::default();
    let mut wide = Vec::new();
    for seed in (0..FIRST).chain(WIDE.into_iter().filter(|&seed| seed >= FIRST)) {
        let volume = few_values::volume(seed % few_values::N_KINDS, 12, &mut Random(seed));
        let field = Shared::new(Field::new(Shared::new(volume.clone())));
        let sweep = Sweep::new(&volume, field, &parameters, (&backend, &Silent));
        let sweep = sweep.unwrap_or_else(|e| panic!("{seed}: {e}"));
        for piece in sweep.pieces() {
            let is_there = |isovalue| sweep.topology.arcs_at(isovalue).contains(&piece.arc);
            let isovalue = sweep.middle(&piece);
            assert!(is_there(isovalue), "{seed}: {piece:?} at {isovalue}");
            if !is_there(0.5 * (piece.low + piece.high)) && wide.last() != Some(&seed) {
                wide.push(seed);
            }
        }
    }
    assert_eq!(wide, WIDE, "seeds with a batch that reaches beyond the middle to the next");
}

/// The first isovalue that lies in the middle of a piece whose component is not there.
fn isovalue_within_a_batch(volume: &Shared<Volume>, backend: &Backend) -> Option<f64> {
    let parameters = Parameters::default();
    let field = Shared::new(Field::new(volume.clone()));
    let sweep = Sweep::new(volume, field, &parameters, (backend, &Silent)).expect("a topology");
    let middles = sweep.pieces().into_iter().map(|p| (p.arc, 0.5 * (p.low + p.high)));
    let mut missing = middles.filter(|(arc, c)| !sweep.topology.arcs_at(*c).contains(arc));
    missing.next().map(|(_, isovalue)| isovalue)
}

#[test]
fn a_sweep_from_or_up_to_an_isovalue_within_a_batch_of_events_comes_to_its_end() {
    let backend = Backend::choose(Choice::Cpu, None).expect("the processor");
    let volume = few_values::volume(WIDE[0] % few_values::N_KINDS, 12, &mut Random(WIDE[0]));
    let volume = Shared::new(volume);
    let within = isovalue_within_a_batch(&volume, &backend).expect("a batch that reaches far");
    let near = 0.02 * (volume.range().1 - volume.range().0);
    for (start, range) in [
        (Some(within), (within - near, within + near)),
        (None, (within - near, within)),
        (None, (within, within + near)),
    ] {
        let parameters = Parameters { start, range: Some(range), ..Parameters::default() };
        let spectrum = compute(&volume, &parameters, &backend, &Silent).expect("a spectrum");
        assert!(!spectrum.triangles.is_empty());
    }
}
