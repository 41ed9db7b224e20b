//! Flags for the parameters of the sweep.

use std::path::PathBuf;

use clap::Args;
use isospectrum::Parameters;
use isospectrum::settings::{IsovalueRange, SweepSettings};

use super::heading;
use super::isovalue::Isovalue;
use super::number_argument::{fraction, not_negative, positive};

/// The parameters of the sweep, grouped by its stages as in the thesis.
#[derive(Args, Debug)]
pub(super) struct ParameterArguments {
    /// Isovalues to cover, e.g. 10:200 or 5%:95%
    ///
    /// The default is the range of the volume. A range that exceeds it is cut to it.
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true, help_heading = heading::TRACKING)]
    range: Option<IsovalueRange>,
    /// Tolerance of the mesh, voxels
    ///
    /// The distance of triangles to the isosurface. What is promised for it is in the README.
    #[arg(long, value_name = "H", value_parser = positive, default_value_t = Parameters::default().error, help_heading = heading::TRACKING)]
    error: f64,
    /// Number of sampling isovalues over the range
    ///
    /// Replaces steps that adapt to the motion of the surface.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..), help_heading = heading::TRACKING)]
    samples: Option<u32>,
    /// Distance between sampling isovalues [default: adapted to the motion of the surface]
    #[arg(long, value_name = "STEP", conflicts_with = "samples", value_parser = positive, hide_short_help = true, help_heading = heading::TRACKING)]
    step: Option<f64>,
    /// Isovalue to start from, in any form that --isovalue takes elsewhere
    #[arg(long, value_name = "C", allow_hyphen_values = true, hide_short_help = true, help_heading = heading::TRACKING)]
    start: Option<Isovalue>,
    /// Number of starts, each with a part of the range of its own [default: by the expected size]
    ///
    /// More starts use more processors. The mesh changes where two parts meet, which may make the file larger.
    #[arg(long, value_name = "N", conflicts_with = "start", hide_short_help = true, help_heading = heading::TRACKING)]
    starts: Option<usize>,
    /// Start from this closed mesh, at the isovalue of --start
    #[arg(long, value_name = "MESH.ply", requires = "start", hide_short_help = true, help_heading = heading::TRACKING)]
    initial_mesh: Option<PathBuf>,
    /// Refine: longest edge, voxels
    #[arg(long, value_name = "LENGTH", value_parser = positive, default_value_t = Parameters::default().max_edge, help_heading = heading::QUALITY)]
    max_edge: f64,
    /// Simplify below this radius ratio
    ///
    /// Triangles of a lower radius ratio are removed.
    #[arg(long, value_name = "RATIO", value_parser = fraction, default_value_t = Parameters::default().min_quality, help_heading = heading::QUALITY)]
    min_quality: f64,
    /// Simplify: remove triangles below this area, divided by the smallest dimension
    #[arg(long, value_name = "AREA", value_parser = not_negative, default_value_t = Parameters::default().min_area, hide_short_help = true, help_heading = heading::QUALITY)]
    min_area: f64,
    /// Refine: refine only triangles above this area, divided by the smallest dimension
    #[arg(long, value_name = "AREA", value_parser = not_negative, default_value_t = Parameters::default().refine_area, hide_short_help = true, help_heading = heading::QUALITY)]
    refine_area: f64,
    /// Relax: fraction of the tangential force to apply per iteration
    #[arg(long, value_name = "SHARE", value_parser = fraction, default_value_t = Parameters::default().relax_strength, hide_short_help = true, help_heading = heading::QUALITY)]
    relax: f64,
    /// Relax: stop below this largest force, voxels; checked every eighth iteration
    #[arg(long, value_name = "FORCE", value_parser = not_negative, default_value_t = Parameters::default().relax_force, hide_short_help = true, help_heading = heading::QUALITY)]
    relax_force: f64,
    /// Relax: maximum number of iterations per sampling step
    #[arg(long, value_name = "N", default_value_t = Parameters::default().relax_iterations, hide_short_help = true, help_heading = heading::QUALITY)]
    relax_iterations: u32,
}

impl ParameterArguments {
    /// Returns the mesh to start from.
    pub(super) fn initial_mesh(&self) -> Option<&PathBuf> {
        self.initial_mesh.as_ref()
    }

    /// Returns the settings of the sweep.
    pub(super) fn settings(&self) -> SweepSettings {
        let parameters = Parameters::default()
            .with_step(self.step)
            .with_samples(self.samples.map(|n| n as usize))
            .with_error(self.error)
            .with_min_quality(self.min_quality)
            .with_min_area(self.min_area)
            .with_refine_area(self.refine_area)
            .with_max_edge(self.max_edge)
            .with_relax_strength(self.relax)
            .with_relax_force(self.relax_force)
            .with_relax_iterations(self.relax_iterations)
            .with_starts(self.starts)
            .with_initial_mesh(self.initial_mesh.clone());
        SweepSettings { range: self.range, start: self.start, parameters }
    }
}
