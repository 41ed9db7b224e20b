//! What happened during a sweep, counted.

use serde::{Deserialize, Serialize};

use crate::spectrum::Spectrum;

/// What happened during a sweep, counted. A spectrum keeps it: [`Counts::of`] (see [`Prepared`](crate::Prepared) for an example).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Counts {
    /// Arcs of the contour tree that show inside the range.
    pub arcs: u64,
    /// Sampling steps taken.
    pub steps: u64,
    /// Sampling steps that were given up, and shorter ones taken in their place.
    pub too_long: u64,
    /// Times that a step was taken again because there were places that could not be tracked.
    pub repeated: u64,
    /// Exchanges between the tracked mesh and exact cells, cluster by cluster.
    pub exchanges: u64,
    /// How many of them were refused, and asked for otherwise.
    pub exchanges_refused: u64,
    /// Times that the seam went over a sample, taken again or not.
    pub passed: u64,
    /// Faces that were off or folded at the end of a step; their cells are exact in the next one.
    pub faults: u64,
    /// Times that all of the mesh became exact, because an exchange was refused again and again.
    pub given_up: u64,
    /// Lists of commands that a GPU was given; none where meshes are small, or kernels run on the CPU.
    pub submissions: u64,
    /// How often results of a GPU were waited for.
    pub read_backs: u64,
}

impl Counts {
    /// Under this name the parameters of a spectrum tell them.
    pub(crate) const NAME: &str = "counts";

    /// Those of the sweep that a spectrum comes from; none of a spectrum that another program wrote. What an older
    /// version did not count is 0.
    pub fn of(spectrum: &Spectrum) -> Option<Counts> {
        let told = spectrum.parameters().get(Counts::NAME)?;
        Counts::deserialize(told).ok()
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
        self.submissions += o.submissions;
        self.read_backs += o.read_backs;
    }
}
