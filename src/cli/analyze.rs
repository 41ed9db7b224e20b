//! `analyze`: the topology of every isosurface of a volume, without computing a spectrum.
//!
//! Events, critical points and regions, and the contour spectrum (Bajaj, Pascucci, Schikore 1997):
//! components, Betti numbers, area and enclosed volume as functions of the isovalue.
//!
//! Events are those of the volume itself, the same as in a spectrum (see [`Event`]). Critical points are those of the field
//! with ties between equal samples broken: a plateau has more of them, which cancel each other.

mod curves;
mod plot;
mod regions;

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Progress as _;
use isospectrum::file::{Output, final_path};
use isospectrum::settings::IsovalueRange;
use isospectrum::spectrum::{Event, EventKind, VolumeInfo, event_persistence, most_persistent};
use isospectrum::unstable::suggestions::candidates;
use isospectrum::unstable::topology::critical::GridElement;
use isospectrum::unstable::topology::dust::Dust;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::unstable::topology::simplify::Simplification;
use isospectrum::unstable::topology::{Topology, TopologyEvent};
use isospectrum::volume::{Placement, Statistics, Unit, Volume, parse_raw_name};
use isospectrum::{Candidate, Error, Parameters, Result};
use serde::Serialize;

use super::heading;
use super::interrupt::Signals;
use super::output;
use super::preparation_arguments::PreparationArguments;
use super::progress::Bar;
use super::report::{self, number};
use super::simplify_arguments::SimplifyArguments;
use super::terminal;
use super::volume_arguments::VolumeArguments;
use curves::Curve;
use plot::Plot;
use regions::ConstantRegion;

const EXAMPLES: &str = "\
Examples:
  isospectrum analyze scan.nrrd --plot curves.svg
  isospectrum analyze scan.nrrd --persistence 2% --simplified smooth.raw";

/// Analyze the topology of every isosurface of a volume
///
/// Prints events, components, handles, areas and volumes along the range, and isovalues of interest.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Analyze {
    #[command(flatten)]
    volume: VolumeArguments,
    #[command(flatten)]
    preparation: PreparationArguments,
    #[command(flatten)]
    simplify: SimplifyArguments,
    /// Isovalues to cover, e.g. 10:200 or 5%:95%
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true, help_heading = heading::OUTPUT)]
    range: Option<IsovalueRange>,
    /// Isovalues along the curves
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(2..), help_heading = heading::OUTPUT)]
    samples: u16,
    /// Plot the curves to a file (.svg), or - for stdout
    #[arg(long, value_name = "FILE", help_heading = heading::OUTPUT)]
    plot: Option<PathBuf>,
    /// Write the volume without noise (.raw)
    ///
    /// Needs --persistence or --min-component. The sample type is that of the simplified samples.
    #[arg(long, value_name = "FILE", requires = "noise", help_heading = heading::OUTPUT)]
    simplified: Option<PathBuf>,
    /// Print JSON
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,
}

impl Analyze {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        let [plot, simplified] = self.open_outputs()?;
        let on_stdout = [&plot, &simplified].map(|o| o.as_ref().is_some_and(Output::is_stdout));
        if usize::from(self.json) + on_stdout.iter().filter(|&&is| is).count() > 1 {
            let message =
                "--json, --plot - and --simplified - all write to stdout, expected one of them";
            return Err(Error::Usage(message.to_owned()).into());
        }
        let (volume, _) = self.preparation.apply(self.volume.read()?)?;
        let (volume, cleaned) = self.simplify.apply(volume)?;
        if let Some(simplified) = simplified {
            self.check_simplified_name(&volume)?;
            simplified.write_bytes(&Signals, &volume.samples().to_le_bytes())?;
        }
        let range = self
            .range
            .map(|range| range.resolve(volume.range(), Some(&Statistics::of(&volume))))
            .transpose()?;
        let range = Parameters::default().with_range(range).within(volume.range())?.range;
        let bar = Bar::new(quiet);
        bar.report(0.0, "topology");
        let field = ExactField::new(&volume)?;
        let topology = Topology::compute(&field)?;
        log::debug!("{} critical points", topology.events.len());
        let covered = range.unwrap_or(volume.range());
        let sample = |n| curves::sample(&field, &topology, covered, n, &bar);
        let curves = sample(usize::from(self.samples))?;
        let plotted = plot.is_some().then(|| sample(plot::MIN_SAMPLES)).transpose()?;
        drop(bar);
        let analysis = Analysis {
            simplification: cleaned.simplification.as_ref(),
            dust: cleaned.dust.as_ref(),
            ..Analysis::of(&volume, range, &topology, &curves)
        };
        if let (Some(plot), Some(curves)) = (plot, plotted) {
            let events: Vec<f64> = analysis.events.iter().map(|event| event.isovalue).collect();
            let shown = Plot {
                name: volume.name(),
                unit: &analysis.unit,
                curves: &curves,
                events: &events,
            };
            plot.write_bytes(&Signals, shown.svg().as_bytes())?;
        }
        if self.json {
            report::print_json("analyze", &analysis)?;
        } else if on_stdout == [false, false] {
            output::print(&analysis.table())?;
        }
        Ok(())
    }

    /// Opens the plot and the simplified volume, if requested.
    fn open_outputs(&self) -> Result<[Option<Output>; 2]> {
        let (volume, mask) = (self.volume.files(), self.preparation.files());
        let inputs: Vec<&Path> = volume.iter().chain(&mask).map(PathBuf::as_path).collect();
        let open = |path: &Path| Output::open(path, &inputs);
        let plot = self.plot.as_deref().map(open).transpose()?;
        let simplified = self.simplified.as_deref().map(open).transpose()?;
        if let (Some(Output::File(plot)), Some(Output::File(simplified))) = (&plot, &simplified)
            && final_path(plot).ok() == final_path(simplified).ok()
        {
            let shown = plot.display();
            let message = format!("{shown}: is both --plot and --simplified, expected two files");
            return Err(Error::Usage(message));
        }
        if let Some(path) = &self.simplified
            && let Some(Output::File(_)) = &simplified
            && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("raw"))
        {
            let shown = path.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .raw")));
        }
        Ok([plot, simplified])
    }

    /// Checks that the name of the simplified volume does not contradict its content: readers of a RAW file take the
    /// dimensions and the sample type from the name.
    fn check_simplified_name(&self, volume: &Volume) -> Result<()> {
        let Some(path) = &self.simplified else { return Ok(()) };
        let (dims, sample_type) = parse_raw_name(path);
        let ([nx, ny, nz], type_name) = (volume.dims(), volume.samples().type_name());
        if dims.is_none_or(|dims| dims == volume.dims())
            && sample_type.is_none_or(|by_name| by_name == type_name)
        {
            return Ok(());
        }
        let shown = path.display();
        Err(Error::Usage(format!(
            "{shown}: the samples are {nx}x{ny}x{nz} {type_name}, expected such a name, e.g. out_{nx}x{ny}x{nz}_{type_name}.raw"
        )))
    }
}

/// The `analyze` report.
#[derive(Serialize)]
struct Analysis<'a> {
    volume: &'a str,
    dims: [usize; 3],
    range: (f64, f64),
    /// The removal of noise before the analysis.
    #[serde(skip_serializing_if = "Option::is_none")]
    simplification: Option<&'a Simplification>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dust: Option<&'a Dust>,
    n_events: usize,
    /// Number of different isovalues of events.
    n_event_isovalues: usize,
    /// Number of events of each kind.
    kinds: Vec<(EventKind, usize)>,
    events: Vec<Event>,
    #[serde(skip)]
    info: VolumeInfo,
    /// Isovalues of interest, with the reason.
    candidates: Vec<Candidate>,
    n_critical_points: usize,
    critical_points: Vec<CriticalPoint>,
    /// Unit of length of the curves: areas are in its square, volumes in its cube.
    unit: String,
    regions: Vec<ConstantRegion>,
    curves: &'a [Curve],
}

/// One critical point of the report.
#[derive(Serialize)]
struct CriticalPoint {
    isovalue: f64,
    kind: EventKind,
    critical_point: &'static str,
    /// Voxel frame.
    position: [f64; 3],
    place: &'static str,
}

impl<'a> Analysis<'a> {
    fn of(
        volume: &'a Volume,
        range: Option<(f64, f64)>,
        topology: &Topology,
        curves: &'a [Curve],
    ) -> Self {
        let (low, high) = range.unwrap_or(volume.range());
        let is_inside = |isovalue: f64| (low..=high).contains(&isovalue);
        let mut events = topology.net_events();
        events.retain(|event| is_inside(event.isovalue));
        let points = topology.events.iter().filter(|point| is_inside(point.isovalue));
        let critical_points: Vec<CriticalPoint> = points.map(CriticalPoint::of).collect();
        let count = |kind| events.iter().filter(|event| event.kind == kind).count();
        Analysis {
            volume: volume.name(),
            dims: volume.dims(),
            info: volume.info(),
            range: (low, high),
            simplification: None,
            dust: None,
            n_events: events.len(),
            n_event_isovalues: n_isovalues(&events),
            kinds: EventKind::ALL.map(|kind| (kind, count(kind))).to_vec(),
            candidates: candidates(volume, topology),
            n_critical_points: critical_points.len(),
            critical_points,
            unit: unit_of(volume.placement()),
            regions: regions::find(volume, (low, high)),
            curves,
            events,
        }
    }

    fn table(&self) -> String {
        let [nx, ny, nz] = self.dims;
        let kinds: Vec<String> =
            self.kinds.iter().map(|&(kind, n)| format!("{n} {}", kind_name(kind))).collect();
        let mut text = report::table(&[
            ("volume", format!("{}, {nx}x{ny}x{nz}", terminal::name(self.volume))),
            ("range", report::range(self.range)),
            ("events", events_line(self.n_events, self.n_event_isovalues)),
            ("of these", kinds.join(", ")),
            (
                "critical points",
                format!(
                    "{}, including those on plateaus that cancel each other",
                    self.n_critical_points
                ),
            ),
            ("constant regions", self.regions.len().to_string()),
            ("candidates", self.candidates_line()),
        ]);
        text += &event_lines(&self.events, &self.info, self.range);
        text += &format!(
            "\narea without the caps that close the isosurface at the border, {0}^2; volume inside it, {0}^3\n",
            self.unit
        );
        text += "  isovalue  components     handles        area      volume\n";
        for curve in self.curves {
            text += &format!(
                "{:>10}  {:>10}  {:>10}  {:>10}  {:>10}\n",
                number(curve.isovalue),
                curve.components,
                curve.handles,
                number(curve.area),
                number(curve.enclosed_volume)
            );
        }
        text
    }
}

impl Analysis<'_> {
    /// Describes isovalues of interest for people.
    fn candidates_line(&self) -> String {
        let named = |c: &Candidate| match c.n_branches {
            Some(n) => format!("{} (most branches of the contour tree, {n})", number(c.isovalue)),
            None => format!("{} (by Otsu)", number(c.isovalue)),
        };
        self.candidates.iter().map(named).collect::<Vec<_>>().join(", ")
    }
}

/// Returns the unit of lengths in the world.
fn unit_of(placement: &Placement) -> String {
    match placement.unit {
        Unit::Unknown if placement.spacing == [1.0; 3] && !placement.is_sheared() => "voxel".into(),
        unit => unit.to_string(),
    }
}

/// Describes the number of events for people.
pub(super) fn events_line(n_events: usize, n_isovalues: usize) -> String {
    format!("{n_events} at {n_isovalues} isovalues")
}

/// The most events that reports describe.
const MAX_DESCRIBED: usize = 10;

/// Describes the events of the largest persistence for people, one per line with its place in the world; empty without events.
pub(super) fn event_lines(events: &[Event], volume: &VolumeInfo, range: (f64, f64)) -> String {
    let mut text = String::new();
    let persistence = event_persistence(events, volume, range);
    for i in most_persistent(&persistence, MAX_DESCRIBED) {
        let event = &events[i];
        if text.is_empty() {
            text += "\nevents of the largest persistence, in shares of the range; that of handles is estimated\n";
        }
        let [x, y, z] =
            volume.placement.world_of_voxel(event.position.map(|x| x as f32)).map(place);
        let change = event.kind.in_words(volume.outside);
        let isovalue = number(event.isovalue);
        let share = report::percent(persistence[i]);
        text += &format!("{isovalue:>10}  {change} at {x}, {y}, {z} ({share})\n");
    }
    text
}

/// A coordinate with four digits.
fn place(x: f64) -> String {
    let digits = 4 - x.abs().max(1.0).log10().floor() as i32 - 1;
    let scale = 10f64.powi(digits);
    number((x * scale).round() / scale)
}

/// Counts the different isovalues of events in ascending order.
pub(super) fn n_isovalues(events: &[Event]) -> usize {
    events.chunk_by(|a, b| a.isovalue == b.isovalue).count()
}

impl CriticalPoint {
    fn of(event: &TopologyEvent) -> Self {
        CriticalPoint {
            isovalue: event.isovalue,
            kind: event.kind,
            critical_point: match event.index {
                0 => "minimum",
                1 => "1-saddle",
                2 => "2-saddle",
                _ => "maximum",
            },
            position: event.position,
            place: match event.element {
                GridElement::Vertex(_) => "sample",
                GridElement::Face { .. } => "face",
                GridElement::Cell(_) => "cell",
                GridElement::Layer => "layer",
            },
        }
    }
}

/// Returns the name of a kind of event for people.
fn kind_name(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Emerge => "emerge",
        EventKind::Merge => "merge",
        EventKind::HandleOpen => "open a handle",
        EventKind::Split => "split",
        EventKind::HandleClose => "close a handle",
        EventKind::Vanish => "vanish",
    }
}
