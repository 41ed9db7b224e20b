//! `info`: what a spectrum file contains.

use std::path::PathBuf;

use clap::Args;
use isospectrum::render::Memory;
use isospectrum::spectrum::{Event, Metadata, Size, Spectrum, VolumeInfo};
use isospectrum::unstable::sweep::{TRACKED_AREA_SHARE, TRACKED_AREA_SHARES};
use isospectrum::unstable::topology::dust::Dust;
use isospectrum::volume::{Placement, Preparation, Space, Unit};
use serde::{Deserialize as _, Serialize};

use super::analyze::{event_lines, events_line, n_isovalues};
use super::{
    heading, output, preparation_arguments, report, simplify_arguments, spectrum_file, terminal,
};

/// Show what a spectrum file contains
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = "Examples:\n  isospectrum info scan.isp")]
pub(super) struct Info {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Print JSON
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,
}

impl Info {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let file = spectrum_file::read_summary(&self.spectrum)?;
        let facts = Facts::of(&file.spectrum, &file.size, file.bytes, file.n_trees);
        if self.json {
            report::print_json("info", &facts)?;
        } else {
            output::print(&facts.table())?;
        }
        Ok(())
    }
}

/// The `info` report.
#[derive(Serialize)]
pub(super) struct Facts<'a> {
    volume: &'a VolumeInfo,
    range: (f64, f64),
    tolerance: f64,
    n_vertices: usize,
    n_triangles: usize,
    n_knots: usize,
    n_isovalues: usize,
    n_collapses: usize,
    bytes: u64,
    gpu_memory: Memory,
    /// Number of bricks with triangles; 1 for a volume that was swept as a whole.
    n_parts: usize,
    /// Steps and repairs of the sweep.
    counts: Option<serde_json::Value>,
    n_events: usize,
    /// Number of different isovalues of events.
    n_event_isovalues: usize,
    /// Share of the area of the isosurface whose triangles are tracked, mean over the range; the rest is extracted exactly.
    tracked_area_share: Option<f64>,
    /// Pairs of isovalue and share.
    tracked_area_shares: Option<serde_json::Value>,
    /// The isovalues of all events, ascending.
    events: Vec<f64>,
    #[serde(skip)]
    all_events: &'a [Event],
    backend: Option<&'a str>,
    adapter: Option<&'a str>,
    parameters: &'a Metadata,
    #[serde(skip)]
    preparation: Option<Preparation>,
    #[serde(skip)]
    dust: Option<Dust>,
}

impl<'a> Facts<'a> {
    /// Describes a spectrum of which only the first sections need be read: `size` counts its triangles, which are in `n_parts` trees of chunks.
    pub(super) fn of(spectrum: &'a Spectrum, size: &Size, n_bytes: u64, n_parts: usize) -> Self {
        let backend = spectrum.parameters().text("/backend");
        // Entries without a type are copied as they are.
        let parameters = serde_json::json!(spectrum.parameters());
        let events: Vec<f64> = spectrum.events().iter().map(|event| event.isovalue).collect();
        Facts {
            volume: spectrum.volume(),
            range: spectrum.range(),
            tolerance: spectrum.tolerance(),
            n_vertices: size.trajectories as usize,
            n_triangles: size.triangles as usize,
            n_knots: size.knots as usize,
            n_isovalues: size.isovalues as usize,
            n_collapses: size.collapses as usize,
            bytes: n_bytes,
            gpu_memory: Memory::of_size(size),
            n_parts,
            counts: parameters.get("counts").cloned(),
            n_events: events.len(),
            n_event_isovalues: n_isovalues(spectrum.events()),
            tracked_area_share: parameters
                .get(TRACKED_AREA_SHARE)
                .and_then(serde_json::Value::as_f64),
            tracked_area_shares: parameters.get(TRACKED_AREA_SHARES).cloned(),
            events,
            all_events: spectrum.events(),
            backend: backend.map(|name| if name == "cpu" { "cpu" } else { "gpu" }),
            adapter: backend.filter(|&name| name != "cpu"),
            parameters: spectrum.parameters(),
            preparation: spectrum.preparation().ok(),
            dust: parameters.get("dust").and_then(|done| Dust::deserialize(done).ok()),
        }
    }

    /// Returns the table for people.
    pub(super) fn table(&self) -> String {
        let VolumeInfo { name, dims: [nx, ny, nz], sample_type, range, placement, .. } =
            self.volume;
        let [sx, sy, sz] = placement.spacing.map(report::number);
        let [of_volume, covered] = [*range, self.range].map(report::range);
        let [name, sample_type] = [name, sample_type].map(|text| terminal::name(text));
        let mut rows = vec![
            ("volume", format!("{name}, {nx}x{ny}x{nz} {sample_type}, {of_volume}")),
            ("spacing", format!("{sx}, {sy}, {sz}{}", unit_after(placement))),
            ("world", world_line(placement)),
            ("range", covered),
            ("tolerance", format!("{} voxel", report::number(self.tolerance))),
            ("triangles", self.n_triangles.to_string()),
            ("vertices", format!("{} with {} knots", self.n_vertices, self.n_knots)),
            ("tracked", self.tracked_line()),
            ("events", events_line(self.n_events, self.n_event_isovalues)),
            ("memory on a GPU", memory_line(&self.gpu_memory)),
            ("size", report::bytes(self.bytes)),
            ("backend", self.backend.unwrap_or("-").to_owned()),
            ("adapter", self.adapter.unwrap_or("-").to_owned()),
        ];
        if let Some(done) = &self.preparation
            && !done.is_none()
        {
            rows.insert(1, ("prepared", preparation_arguments::describe(done)));
        }
        if let Some(done) = &self.dust {
            rows.insert(rows.len().min(2), ("dust", simplify_arguments::describe_dust(done)));
        }
        if self.n_parts > 1 {
            rows.push(("parts", self.n_parts.to_string()));
        }
        if log::log_enabled!(log::Level::Debug) {
            let counts = self.counts.as_ref().map_or_else(|| "-".to_owned(), report::counts);
            rows.push(("steps and repairs", counts));
        }
        report::table(&rows) + &event_lines(self.all_events, self.volume, self.range)
    }

    /// Returns the tolerance, voxels.
    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Describes how much of the isosurface is tracked.
    pub(super) fn tracked_line(&self) -> String {
        self.tracked_area_share.map_or_else(
            || "-".to_owned(),
            |share| format!("{} of the area, mean over the range", report::percent(share)),
        )
    }

    /// Returns the rows of the report after a computation, without the measured quality.
    pub(super) fn summary(&self) -> Vec<(&'static str, String)> {
        vec![
            ("tracked", self.tracked_line()),
            ("triangles", self.n_triangles.to_string()),
            ("events", events_line(self.n_events, self.n_event_isovalues)),
            ("size", report::bytes(self.bytes)),
        ]
    }
}

/// Returns the unit of a placement with a space before it, or nothing if it is unknown.
fn unit_after(placement: &Placement) -> String {
    if placement.unit == Unit::Unknown { String::new() } else { format!(" {}", placement.unit) }
}

/// Describes the position of the volume in the world and the shape of its axes.
fn world_line(placement: &Placement) -> String {
    let [x, y, z] = placement.origin.map(report::number);
    let mut line = format!("origin {x}, {y}, {z}{}", unit_after(placement));
    if placement.space != Space::Unknown {
        line += &format!(", {}", placement.space);
    }
    if placement.span() < 0.0 {
        line += ", left-handed axes";
    }
    if placement.is_sheared() || placement.is_stretched() {
        let (low, high) = placement.stretch();
        let [low, high] = [low, high].map(report::number);
        let why = if placement.is_sheared() { "sheared" } else { "anisotropic" };
        line += &format!(
            ", {why}: a tolerance of one voxel is {low} to {high} smallest spacings in the world"
        );
    }
    line
}

/// Describes the memory for trajectories and for the longest list of triangles at an isovalue.
fn memory_line(memory: &Memory) -> String {
    let Memory { trajectories, triangles, most_triangles, .. } = *memory;
    format!(
        "{}: trajectories {}, and {} for at most {most_triangles} triangles at an isovalue",
        report::bytes(trajectories + triangles),
        report::bytes(trajectories),
        report::bytes(triangles)
    )
}
