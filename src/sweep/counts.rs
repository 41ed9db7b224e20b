//! Counters of a sweep.

use serde::{Deserialize, Serialize};

use crate::spectrum::Spectrum;

/// Counters of a sweep. A spectrum keeps them: [`Counts::of`] (see [`Prepared`](crate::Prepared) for an example).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Counts {
    /// Arcs of the contour tree inside the range.
    pub arcs: u64,
    /// Sampling steps taken.
    pub steps: u64,
    /// Sampling steps that were abandoned in favour of shorter ones.
    pub too_long: u64,
    /// Retries of steps after places could not be tracked.
    pub repeated: u64,
    /// Exchanges between the tracked mesh and exact cells, cluster by cluster.
    pub exchanges: u64,
    /// How many of them were refused.
    pub exchanges_refused: u64,
    /// Samples crossed by the seam, including those in steps that were retried.
    pub passed: u64,
    /// Faces that were off the isosurface or folded at the end of a step; their cells are exact in the next one.
    pub faults: u64,
    /// How often the whole mesh became exact because an exchange was refused repeatedly.
    pub given_up: u64,
    /// Lifetimes of tracked triangles that an exchange with exact cells ended.
    pub ended_by_exchanges: u64,
    /// Lifetimes that the seam ended by crossing a sample.
    pub ended_by_seam: u64,
    /// Lifetimes that flips ended.
    pub ended_by_flips: u64,
    /// Lifetimes that splits ended.
    pub ended_by_splits: u64,
    /// Lifetimes that collapses ended.
    pub ended_by_collapses: u64,
    /// Lifetimes that repairs of turned, crossing or distant faces ended.
    pub ended_by_repairs: u64,
    /// Command buffers submitted to a GPU; zero if meshes are small, or kernels run on the CPU.
    pub submissions: u64,
    /// How often the CPU waited for results of a GPU.
    pub read_backs: u64,
}

impl Counts {
    /// Their key in a spectrum's metadata.
    pub(crate) const NAME: &str = "counts";

    /// The counters of the sweep that a spectrum comes from; `None` for a spectrum of another program. Missing counters are 0.
    pub fn of(spectrum: &Spectrum) -> Option<Counts> {
        let counts = spectrum.parameters().get(Counts::NAME)?;
        Counts::deserialize(counts).ok()
    }

    pub(crate) fn add(&mut self, o: &Counts) {
        self.arcs += o.arcs;
        self.steps += o.steps;
        self.too_long += o.too_long;
        self.repeated += o.repeated;
        self.exchanges += o.exchanges;
        self.exchanges_refused += o.exchanges_refused;
        self.passed += o.passed;
        self.faults += o.faults;
        self.given_up += o.given_up;
        self.ended_by_exchanges += o.ended_by_exchanges;
        self.ended_by_seam += o.ended_by_seam;
        self.ended_by_flips += o.ended_by_flips;
        self.ended_by_splits += o.ended_by_splits;
        self.ended_by_collapses += o.ended_by_collapses;
        self.ended_by_repairs += o.ended_by_repairs;
        self.submissions += o.submissions;
        self.read_backs += o.read_backs;
    }
}
