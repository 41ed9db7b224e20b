//! `components`: a table of the components of the isosurface at one isovalue.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use isospectrum::export::place_in_world;
use isospectrum::spectrum::{Component, Components as Found, End, Lineage, lineages};
use isospectrum::volume::Unit;
use serde::Serialize;

use super::isovalue::{self, Isovalue};
use super::keep_arguments::KeepArguments;
use super::report::{self, number, number_or_dash};
use super::spectrum_file::Opened;
use super::{empty, heading, output};

const EXAMPLES: &str = "\
Examples:
  isospectrum components scan.isp -c 1200
  isospectrum components scan.isp -c 50% --min-volume 10 --csv > components.csv";

/// List the components of the isosurface at one isovalue
///
/// Volume, area and box are in the unit of the spacing. As the isovalue rises, a component is born where it appears or
/// splits off a larger one, and dies where it vanishes or merges with a larger one.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = EXAMPLES)]
pub(super) struct Components {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: 120, 50%, p99, 2.5sigma or top:1%
    ///
    /// A number, a percentage of the range (50%), a percentile of the samples (p99), standard deviations above their mean
    /// (2.5sigma), or the value that the highest 1 % of them exceed (top:1%).
    #[arg(short = 'c', long, value_name = "C", allow_hyphen_values = true)]
    isovalue: Isovalue,
    #[command(flatten)]
    keep: KeepArguments,
    /// Leave out births and deaths
    ///
    /// They need all isovalues. Without them, only the chunks of the file that the isovalue needs are read.
    #[arg(long, help_heading = heading::OUTPUT)]
    no_lineage: bool,
    /// Number of rows of the table
    ///
    /// --json and --csv print all components.
    #[arg(long, value_name = "N", default_value_t = 20, help_heading = heading::OUTPUT)]
    rows: usize,
    /// Print JSON
    #[arg(long, conflicts_with = "csv", help_heading = heading::OUTPUT)]
    json: bool,
    /// Print comma-separated values
    #[arg(long, help_heading = heading::OUTPUT)]
    csv: bool,
}

/// The `components` report.
#[derive(Serialize)]
struct Report {
    isovalue: f64,
    /// Unit of lengths; none if the volume does not specify one.
    unit: Option<String>,
    n_components: usize,
    components: Vec<Row>,
}

/// One component of the report.
#[derive(Serialize)]
struct Row {
    /// From 1, the largest, counted over all components of the isosurface.
    number: usize,
    /// True if it is around a hollow: lower values, with `--outside high` higher ones.
    is_cavity: bool,
    /// Enclosed volume, caps included; cubes of the unit of the spacing.
    volume: f64,
    /// Without caps, squares of the unit of the spacing.
    area: f64,
    euler: i64,
    n_triangles: usize,
    /// None with `--no-lineage`.
    #[serde(flatten)]
    ends: Option<Ends>,
    /// Lowest and highest corner of its bounding box, world.
    bounds: [[f64; 3]; 2],
}

/// Birth and death of a component.
#[derive(Serialize)]
struct Ends {
    /// Isovalue of its birth; none if it exists at the low end of the range.
    birth: Option<f64>,
    /// The larger component that it splits off; none if it appears.
    splits_from: Option<usize>,
    /// Isovalue of its death; none if it exists at the high end of the range.
    death: Option<f64>,
    /// The larger component that it merges with; none if it vanishes.
    merges_into: Option<usize>,
}

impl Ends {
    fn new(lineage: &Lineage) -> Ends {
        let isovalue = |end: Option<End>| end.map(|end| end.isovalue);
        let other = |end: Option<End>| end.and_then(|end| end.joins).map(|i| i as usize + 1);
        Ends {
            birth: isovalue(lineage.birth),
            splits_from: other(lineage.birth),
            death: isovalue(lineage.death),
            merges_into: other(lineage.death),
        }
    }
}

impl Row {
    /// `component` is measured relative to `origin`, the world position of the first sample.
    fn new(i: usize, component: &Component, ends: Option<Ends>, origin: [f64; 3]) -> Row {
        Row {
            number: i + 1,
            is_cavity: component.volume < 0.0,
            volume: component.volume.abs(),
            area: component.area,
            euler: component.euler,
            n_triangles: component.n_triangles,
            ends,
            bounds: component.bounds.map(|p| std::array::from_fn(|a| p[a] + origin[a])),
        }
    }
}

impl Components {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let opened = Opened::open(&self.spectrum)?;
        let isovalue = isovalue::in_spectrum(self.isovalue, opened.header())?;
        let spectrum =
            if self.no_lineage { opened.around(&[isovalue])? } else { opened.whole()? };
        let mesh = spectrum.mesh_at(isovalue)?;
        empty::warn(&spectrum, isovalue, false);
        let found = Found::of(&mesh);
        let kept = found.kept(&mesh, &self.keep.of(&spectrum));
        let lineages = match self.no_lineage {
            true => vec![None; found.list.len()],
            false => {
                let all = lineages(&spectrum, isovalue, &found)?;
                all.into_iter().map(Some).collect()
            }
        };
        let placement = &spectrum.volume().placement;
        let placed = found.moved(&place_in_world(mesh, placement));
        let rows = placed.list.iter().zip(&lineages).enumerate().zip(kept).filter(|row| row.1);
        let components: Vec<Row> = rows
            .map(|((i, (component, lineage)), _)| {
                Row::new(i, component, lineage.as_ref().map(Ends::new), placement.origin)
            })
            .collect();
        let unit = Some(placement.unit).filter(|&unit| unit != Unit::Unknown);
        let unit = unit.map(|unit| unit.to_string());
        let report = Report { isovalue, unit, n_components: found.list.len(), components };
        if self.json {
            report::print_json("components", &report)?;
        } else if self.csv {
            output::print(&csv(&report.components))?;
        } else {
            output::print(&self.table(&report))?;
        }
        Ok(())
    }

    fn table(&self, report: &Report) -> String {
        let Report { isovalue, unit, n_components, components } = report;
        let plural = if *n_components == 1 { "" } else { "s" };
        let mut text =
            format!("{n_components} component{plural} at isovalue {}", number(*isovalue));
        if components.len() < *n_components {
            let _ = write!(text, ", {} of them kept", components.len());
        }
        text.push('\n');
        let powered = |name: &str, power: &str| match unit {
            Some(unit) => format!("{name}, {unit}{power}"),
            None => name.to_owned(),
        };
        let head = ["no.", "", "", "Euler", "triangles", "birth", "death", ""];
        let mut head = head.map(str::to_owned);
        [head[1], head[2], head[7]] =
            [powered("volume", "^3"), powered("area", "^2"), powered("box", "")];
        let mut rows = vec![head.to_vec()];
        rows.extend(components.iter().take(self.rows).map(|row| cells(row).to_vec()));
        if self.no_lineage {
            rows.iter_mut().for_each(|row| _ = row.drain(5..7));
        }
        text += &aligned(&rows);
        let rest = components.get(self.rows..).unwrap_or_default();
        if !rest.is_empty() {
            let volume: f64 = rest.iter().map(|row| row.volume).sum();
            let area: f64 = rest.iter().map(|row| row.area).sum();
            let _ = writeln!(
                text,
                "{} smaller components not shown: total volume {}, total area {} (--rows, --csv)",
                rest.len(),
                number(volume),
                number(area)
            );
        }
        text
    }
}

fn cells(row: &Row) -> [String; 8] {
    let end = |isovalue: Option<f64>, word: &str, other: Option<usize>| match other {
        Some(other) => format!("{} {word} {other}", number_or_dash(isovalue)),
        None => number_or_dash(isovalue),
    };
    let corner = |corner: [f64; 3]| corner.map(number).join(",");
    let cavity = if row.is_cavity { " (cavity)" } else { "" };
    let ends = row.ends.as_ref();
    let [birth, death] = [ends.and_then(|e| e.birth), ends.and_then(|e| e.death)];
    let [from, into] = [ends.and_then(|e| e.splits_from), ends.and_then(|e| e.merges_into)];
    [
        row.number.to_string(),
        format!("{}{cavity}", number(row.volume)),
        number(row.area),
        row.euler.to_string(),
        row.n_triangles.to_string(),
        end(birth, "from", from),
        end(death, "into", into),
        format!("{} to {}", corner(row.bounds[0]), corner(row.bounds[1])),
    ]
}

/// Returns the rows with aligned columns, two spaces apart.
fn aligned(rows: &[Vec<String>]) -> String {
    let n = rows.first().map_or(0, Vec::len);
    let width = |i: usize| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..n).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    rows.iter().map(line).collect()
}

/// Returns one line per component, with numbers in full precision; a missing value is empty.
fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "number,is_cavity,volume,area,euler,n_triangles,birth,splits_from,death,merges_into,\
         min_x,min_y,min_z,max_x,max_y,max_z\n",
    );
    for row in rows {
        let lineage = row.ends.as_ref();
        let ends = [lineage.and_then(|e| e.birth), lineage.and_then(|e| e.death)]
            .map(|c| c.map_or_else(String::new, |c| c.to_string()));
        let others = [lineage.and_then(|e| e.splits_from), lineage.and_then(|e| e.merges_into)]
            .map(|number| number.map_or_else(String::new, |number| number.to_string()));
        let bounds: Vec<String> = row.bounds.iter().flatten().map(f64::to_string).collect();
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{},{}",
            row.number,
            row.is_cavity,
            row.volume,
            row.area,
            row.euler,
            row.n_triangles,
            ends[0],
            others[0],
            ends[1],
            others[1],
            bounds.join(",")
        );
    }
    text
}
