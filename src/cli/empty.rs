//! Warnings about empty surfaces, with the reason.

use isospectrum::spectrum::{Keep, Spectrum};
use isospectrum::unstable::numbers::distinct;

/// Warns if the mesh at an isovalue has no triangle; if `open`, caps do not count.
pub(super) fn warn(spectrum: &Spectrum, isovalue: f64, open: bool) {
    if is_empty(spectrum, isovalue, open) {
        log::warn!("{}", message(isovalue, spectrum.range(), open));
    }
}

/// Warns if no component is kept.
pub(super) fn warn_of_components(n_triangles: usize, keep: &Keep) {
    if n_triangles == 0 && !keep.is_all() {
        log::warn!("no component is kept; `isospectrum components` lists their sizes");
    }
}

/// True if the mesh at an isovalue has no triangle; if `open`, caps do not count.
pub(super) fn is_empty(spectrum: &Spectrum, isovalue: f64, open: bool) -> bool {
    spectrum.rank_at(isovalue).is_none_or(|rank| {
        let is_alive = |&(birth, death): &(u32, u32)| birth <= rank && rank < death;
        let shown = spectrum.triangles().iter().filter(|t| !(open && t.cap));
        !shown.map(|t| (t.birth, t.death)).any(|lifetime| is_alive(&lifetime))
    })
}

/// Explains why the surface at an isovalue is empty.
fn message(isovalue: f64, (low, high): (f64, f64), open: bool) -> String {
    let reason = if isovalue == low || isovalue == high {
        "the isovalue is at an end of the range"
    } else if open {
        "--open leaves out all of its triangles"
    } else {
        "all samples are on one side of the isovalue"
    };
    let [isovalue, low, high] = distinct([isovalue, low, high]);
    format!(
        "the surface at isovalue {isovalue} is empty: {reason}; the range is {low} to {high}, try 50%"
    )
}
