//! What to say where there is no surface: an empty file alone is a riddle.

use isospectrum::spectrum::{Keep, Spectrum};

use super::report;

/// Warns where the mesh at an isovalue, or what is left of it without its caps, has no triangle.
pub(super) fn warn(spectrum: &Spectrum, isovalue: f64, open: bool) {
    if is_empty(spectrum, isovalue, open) {
        log::warn!("{}", why(isovalue, spectrum.range(), open));
    }
}

/// Warns where no component is kept.
pub(super) fn warn_of_components(n_triangles: usize, keep: &Keep) {
    if n_triangles == 0 && !keep.is_all() {
        log::warn!("no component is kept: `isospectrum components` tells how large they are");
    }
}

/// Whether there is nothing to see at an isovalue.
pub(super) fn is_empty(spectrum: &Spectrum, isovalue: f64, open: bool) -> bool {
    spectrum.rank_at(isovalue).is_none_or(|rank| {
        let lives = |&(birth, death): &(u32, u32)| birth <= rank && rank < death;
        let shown = spectrum.triangles().iter().filter(|t| !(open && t.cap));
        !shown.map(|t| (t.birth, t.death)).any(|life| lives(&life))
    })
}

fn why(isovalue: f64, (low, high): (f64, f64), open: bool) -> String {
    let place = if isovalue == low || isovalue == high {
        "it is an end of the range, where the surface has not appeared yet or is gone"
    } else if open {
        "without the caps nothing of the surface is inside the volume"
    } else {
        "no sample is on one side of it"
    };
    let [isovalue, low, high] = [isovalue, low, high].map(report::number);
    format!(
        "the surface at isovalue {isovalue} is empty: {place}; the range is {low} to {high}, try 50%"
    )
}
