//! The march over the sampling isovalues, upwards and downwards from one start or several, for the whole isosurface at once.
//!
//! # The sweep in eighteen steps
//!
//! Paths are relative to `src/sweep`; steps 5 to 17 are repeated for every step of the march.
//!
//! 1. **Topology and calendar** (`context.rs`, `calendar.rs`). The exact field orders all samples by keys without ties. The
//!    contour tree gives the events. The calendar lists by key everything that the isovalue passes: samples, saddles of lattice
//!    squares, squares with four equal samples, critical points.
//! 2. **Starts** (`march/stretches.rs`, `march/run.rs`). The range is divided into stretches, as many as the forecast allows. The
//!    start isovalue of a stretch has half of its work on either side, work being range and number of samples in equal parts. There
//!    the whole isosurface is exact, that is, the exact extraction (with an initial mesh it is tracked instead, `initial.rs`). After
//!    the first exchange the state is copied, and one march goes up, one down, to the ends of the stretch. All marches run in
//!    parallel. At a meeting of two stretches one mesh ends and the other begins.
//! 3. **State** (`march/state.rs`, `tracked.rs`, `places.rs`, `region.rs`). The tracked mesh, a half-edge mesh closed by a fan of
//!    caps over every boundary loop; the block of each of its vertices; the region of exact cells, in blocks of 2^3; by block the isovalue since which it is exact, and until
//!    which step it must stay exact (back-off).
//! 4. **Seam** (`tracked.rs`, `polyline.rs`). The lattice squares between exact cells and others. The vertices of the mesh's
//!    boundary are bound to lattice edges of the seam and are where the exact extraction has them, at every isovalue.
//! 5. **Step length** (`march/length.rs`). So long that a vertex moves a quarter of a voxel at the slope that nine of ten
//!    vertices reach. Twice as long if hardly any block is exact; half as long after a step that failed, or if the events
//!    of the step concern much of the mesh and most of them are in its second half.
//! 6. **Plan** (`march/plan.rs`). Blocks near critical points of the step become exact. Exact blocks stay exact if a critical
//!    point follows within two step lengths, if they have flat squares of the next sample value, or while their back-off lasts.
//!    A box of 8^3 blocks most of which are exact becomes exact as a whole.
//! 7. **Closure** (`calendar.rs`, `region.rs`). The region grows until the seam is a manifold, every sample that the seam will
//!    cross is regular for the field on it, and no saddle of a seam square is passed.
//! 8. **Exchange** (`march/exchanges.rs`, `clusters.rs`, `part.rs`, `exchange.rs`, `exchange/`, `join.rs`). The mesh is
//!    changed to fit the region, first where cells become exact, then where they are released, in clusters of blocks that
//!    are independent of each other. To become exact: the mesh is cut along lattice squares, the inside is removed, the
//!    rim moves onto the exact polyline. To be released: the exact triangles become part of the mesh.
//! 9. **Refusals** (`exchange/refused.rs`, `check.rs`). A cluster's exchange is refused unless its boundary is the exact
//!    polyline. A refusal makes more blocks exact: around the failing samples; after some attempts also those that were to be
//!    released, then whole components of the mesh, in the end everything.
//! 10. **New triangles** (`remesh/improve.rs`). Triangles that come from exact cells are split, collapsed, flipped and relaxed.
//! 11. **Motion** (`transport.rs`). Free vertices are projected along their normals, and relaxed. Failures are: vertices that do not
//!     reach the isosurface or move too far, faces turned over, faces off the isosurface at the end or half-way, faces that cross others.
//! 12. **Too long** (`march/length.rs`). If too much of the mesh fails, the step is abandoned and a shorter one is tried.
//! 13. **Repair** (`repair.rs`, `march/step.rs`). Faces that are turned over or cross others are repaired once by flips and
//!     collapses, and the motion is repeated near them.
//! 14. **Slide** (`march/slide.rs`, `tracked.rs`). The seam crosses the samples of the step one by one, in the order of their
//!     values: vertices bound to lattice edges on one side of the sample become bound to those on the other. Between two values,
//!     faces that have turned over are repaired, and faces far from the isosurface are failures.
//! 15. **Check** (`check.rs`). The boundary of the mesh is compared with the exact polyline edge by edge, and every part of the
//!     mesh by its Euler characteristic with an exact count of the isosurface in the same cells.
//! 16. **Failure** (`march/step.rs`). Mesh and record are rolled back, the blocks of all failures become exact, or their
//!     neighbours if they are exact, and the step is tried again. After some attempts only failures of seam and topology count. A
//!     block's back-off doubles whenever it fails again soon.
//! 17. **Finish** (`march/step.rs`, `remesh.rs`, `record.rs`). The mesh is remeshed: flip, refine, split, collapse, flip; failing faces
//!     are repaired; knots of vertices and lifetimes of triangles are recorded. Blocks of faces that still fail become exact in the
//!     next step.
//! 18. **Spectrum** (`compute.rs`, `exact.rs`, `seam_triangles.rs`, `chords.rs`, `thin.rs`, `patch.rs`). Triangles of the exact
//!     extraction are added for every interval in which a block was exact, and trajectories are thinned to the tolerance.

mod ends;
mod exchanges;
mod length;
mod plan;
mod run;
mod slide;
mod state;
mod step;
mod stretches;

pub(super) use run::{Marched, march};
