//! `info`: what a spectrum file holds.

use std::path::PathBuf;

use clap::Args;
use isospectrum::file::{SpectrumFolder, is_folder};
use isospectrum::render::Memory;
use isospectrum::spectrum::{Metadata, Size, Spectrum, VolumeInfo};
use isospectrum::unstable::sweep::{TRACKED_AREA_SHARE, TRACKED_AREA_SHARES};
use isospectrum::unstable::topology::dust::Dust;
use isospectrum::volume::{Placement, Preparation, Space, Unit};
use serde::{Deserialize as _, Serialize};

use super::analyze::{events_line, n_isovalues};
use super::{output, preparation_arguments, report, simplify_arguments, spectrum_file, terminal};

/// Tell what a spectrum file holds
#[derive(Args, Debug)]
pub(super) struct Info {
    /// Spectrum (.isp, or a folder .ispt)
    spectrum: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Info {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let (folder, file);
        let facts = if is_folder(&self.spectrum) {
            folder = SpectrumFolder::open(&self.spectrum)?;
            Facts::of_folder(&folder)
        } else {
            file = spectrum_file::read_summary(&self.spectrum)?;
            Facts::told(&file.spectrum, &file.size, file.bytes)
        };
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
    /// Not known of a folder of parts, none of which is read.
    n_isovalues: Option<usize>,
    n_collapses: usize,
    bytes: u64,
    /// Not known of a folder of parts.
    gpu_memory: Option<Memory>,
    /// Of a folder, how many parts it has, those without triangles too.
    #[serde(skip_serializing_if = "Option::is_none")]
    n_parts: Option<usize>,
    /// How often the sweep met trouble, and what it did then.
    counts: Option<serde_json::Value>,
    n_events: usize,
    /// How many isovalues they share.
    n_event_isovalues: usize,
    /// Share of the isosurface's area whose triangles are tracked, mean over the range; the rest is the exact extraction.
    tracked_area_share: Option<f64>,
    /// [isovalue, share] each
    tracked_area_shares: Option<serde_json::Value>,
    /// The isovalues of all events, ascending.
    events: Vec<f64>,
    backend: Option<&'a str>,
    adapter: Option<&'a str>,
    parameters: &'a Metadata,
    #[serde(skip)]
    preparation: Option<Preparation>,
    #[serde(skip)]
    dust: Option<Dust>,
}

impl<'a> Facts<'a> {
    /// What there is to say of a spectrum that takes `n_bytes` in its file.
    pub(super) fn of(spectrum: &'a Spectrum, n_bytes: u64) -> Self {
        Facts::told(spectrum, &Size::of(spectrum), n_bytes)
    }

    /// What there is to say of a spectrum, which need have no triangles, that is of a size and takes `n_bytes` in its file.
    fn told(spectrum: &'a Spectrum, size: &Size, n_bytes: u64) -> Self {
        let backend = spectrum.parameters().text("/backend");
        // Names that have no type are handed on as they stand.
        let told = serde_json::json!(spectrum.parameters());
        let events: Vec<f64> = spectrum.events().iter().map(|event| event.isovalue).collect();
        Facts {
            volume: spectrum.volume(),
            range: spectrum.range(),
            tolerance: spectrum.tolerance(),
            n_vertices: size.trajectories as usize,
            n_triangles: size.triangles as usize,
            n_knots: size.knots as usize,
            n_isovalues: Some(size.isovalues as usize),
            n_collapses: size.collapses as usize,
            bytes: n_bytes,
            gpu_memory: Some(Memory::of_size(size)),
            n_parts: None,
            counts: told.get("counts").cloned(),
            n_events: events.len(),
            n_event_isovalues: n_isovalues(spectrum.events()),
            tracked_area_share: told.get(TRACKED_AREA_SHARE).and_then(serde_json::Value::as_f64),
            tracked_area_shares: told.get(TRACKED_AREA_SHARES).cloned(),
            events,
            backend: backend.map(|name| if name == "cpu" { "cpu" } else { "gpu" }),
            adapter: backend.filter(|&name| name != "cpu"),
            parameters: spectrum.parameters(),
            preparation: spectrum.preparation().ok(),
            dust: told.get("dust").and_then(|done| Dust::deserialize(done).ok()),
        }
    }

    /// What there is to say of a folder of parts, none of which is read.
    pub(super) fn of_folder(folder: &'a SpectrumFolder) -> Self {
        let [n_vertices, n_knots, n_triangles] = folder.index().size.map(|n| n as usize);
        Facts {
            n_vertices,
            n_knots,
            n_triangles,
            n_isovalues: None,
            gpu_memory: None,
            n_parts: Some(folder.index().parts.len()),
            ..Facts::of(folder.whole(), folder.n_bytes())
        }
    }

    /// The same for people.
    pub(super) fn table(&self) -> String {
        let VolumeInfo { name, dims: [nx, ny, nz], sample_type, range, placement, .. } =
            self.volume;
        let [sx, sy, sz] = placement.spacing.map(report::number);
        let (low, high) = (report::number(range.0), report::number(range.1));
        let ends = (report::number(self.range.0), report::number(self.range.1));
        let [name, sample_type] = [name, sample_type].map(|text| terminal::name(text));
        let mut rows = vec![
            ("volume", format!("{name}, {nx}x{ny}x{nz} {sample_type}, {low} to {high}")),
            ("spacing", format!("{sx}, {sy}, {sz}{}", unit_after(placement))),
            ("world", world_line(placement)),
            ("range", format!("{} to {}", ends.0, ends.1)),
            ("tolerance", format!("{} voxel", report::number(self.tolerance))),
            ("triangles", self.n_triangles.to_string()),
            ("vertices", format!("{} with {} knots", self.n_vertices, self.n_knots)),
            ("tracked", self.tracked_line()),
            ("events", events_line(self.n_events, self.n_event_isovalues)),
            ("memory on a GPU", self.gpu_memory.as_ref().map_or("-".to_owned(), memory_line)),
            ("size", report::bytes(self.bytes)),
            ("backend", self.backend.unwrap_or("-").to_owned()),
            ("adapter", self.adapter.unwrap_or("-").to_owned()),
        ];
        if let Some(done) = &self.preparation
            && !done.is_none()
        {
            rows.insert(1, ("prepared", preparation_arguments::sentence(done)));
        }
        if let Some(done) = &self.dust {
            rows.insert(rows.len().min(2), ("dust", simplify_arguments::dust_sentence(done)));
        }
        if let Some(n) = self.n_parts {
            rows.push(("parts", n.to_string()));
        }
        if log::log_enabled!(log::Level::Debug) {
            let counts = self.counts.as_ref().map_or_else(|| "-".to_owned(), report::counts);
            rows.push(("steps and repairs", counts));
        }
        report::table(&rows)
    }

    /// The tolerance, voxels.
    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// How much of the isosurface is a mesh that moves.
    pub(super) fn tracked_line(&self) -> String {
        self.tracked_area_share.map_or_else(
            || "-".to_owned(),
            |share| format!("{} of the area, mean over the range", report::percent(share)),
        )
    }

    /// What there is to say once a spectrum has been computed, besides what was measured.
    pub(super) fn summary(&self) -> Vec<(&'static str, String)> {
        vec![
            ("tracked", self.tracked_line()),
            ("triangles", self.n_triangles.to_string()),
            ("events", events_line(self.n_events, self.n_event_isovalues)),
            ("size", report::bytes(self.bytes)),
        ]
    }
}

/// The unit of a placement, where it is known.
fn unit_after(placement: &Placement) -> String {
    if placement.unit == Unit::Unknown { String::new() } else { format!(" {}", placement.unit) }
}

/// Where the volume lies in the world, and what its axes are like there.
fn world_line(placement: &Placement) -> String {
    let [x, y, z] = placement.origin.map(report::number);
    let mut line = format!("origin {x}, {y}, {z}{}", unit_after(placement));
    if placement.space != Space::Unknown {
        line += &format!(", {}", placement.space);
    }
    if placement.span() < 0.0 {
        line += ", left-handed axes";
    }
    if placement.is_sheared() {
        let (low, high) = placement.stretch();
        let [low, high] = [low, high].map(report::number);
        line += &format!(", sheared: a voxel of tolerance is {low} to {high} voxels there");
    }
    line
}

/// Trajectories, and the list of living triangles where it is longest.
fn memory_line(memory: &Memory) -> String {
    let Memory { trajectories, triangles, most_triangles, .. } = *memory;
    format!(
        "{}: {} of trajectories, {} for at most {most_triangles} triangles at an isovalue",
        report::bytes(trajectories + triangles),
        report::bytes(trajectories),
        report::bytes(triangles)
    )
}
