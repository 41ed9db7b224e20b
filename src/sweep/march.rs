//! One march over the sampling isovalues for the whole isosurface, up and down from one, by steps (`march/step.rs`) of some length
//! (`march/length.rs`): plan (`march/plan.rs`), exchange (`march/exchanges.rs`), move, check, slide (`march/slide.rs`), remesh, record.

mod exchanges;
mod length;
mod plan;
mod run;
mod slide;
mod state;
mod step;

pub(super) use run::{Marched, march};
