//! The contour spectrum as a picture: one self-contained SVG.
//!
//! Four panels share the isovalue axis: area with enclosed volume, components with cavities, Euler
//! characteristic, and the events by kind. Events are counted per column of the picture and drawn
//! as ticks whose height grows with the logarithm of the count, so the size of the file does not
//! depend on how many there are.

use std::fmt::Write;

use crate::topology::curves::ContourSpectrum;
use crate::topology::{Event, EventKind};

const WIDTH: f64 = 960.0;
const LEFT: f64 = 92.0;
const RIGHT: f64 = 92.0;
const TOP: f64 = 56.0;
const PANEL: f64 = 132.0;
const GAP: f64 = 34.0;
/// Height of the row of one kind of event.
const ROW: f64 = 22.0;
/// Columns in which events are counted.
const N_COLUMNS: usize = 388;

const BLUE: &str = "#1f6fb4";
const ORANGE: &str = "#d9730d";
const GREEN: &str = "#2e8b57";
const PURPLE: &str = "#7b4ab5";
const GREY: &str = "#8a8f98";
const INK: &str = "#22262b";

/// Kinds of events, how they are called, and their colours.
const KINDS: [(EventKind, &str, &str); 6] = [
    (EventKind::Emerge, "emerge", GREEN),
    (EventKind::Merge, "merge", BLUE),
    (EventKind::HandleOpen, "handle opens", PURPLE),
    (EventKind::Split, "split", ORANGE),
    (EventKind::HandleClose, "handle closes", "#b0558f"),
    (EventKind::Vanish, "vanish", "#c23b3b"),
];

/// One curve: its values, colour and name.
struct Curve<'a> {
    values: Vec<f64>,
    color: &'a str,
    name: &'a str,
    /// Drawn as steps: counts have no values in between.
    steps: bool,
    /// Whether its axis is the right one.
    right: bool,
}

/// The contour spectrum with its events (see [`Topology::net_events`]) as an SVG document titled
/// `title`.
///
/// [`Topology::net_events`]: crate::topology::Topology::net_events
pub fn contour_spectrum_svg(title: &str, spectrum: &ContourSpectrum, events: &[Event]) -> String {
    let height = TOP + 3.0 * (PANEL + GAP) + 6.0 * ROW + 56.0;
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         font-family=\"system-ui, Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"{INK}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>"
    );
    text(
        &mut svg,
        LEFT,
        24.0,
        "start",
        INK,
        &format!("Contour spectrum of {title}"),
        "font-size=\"16\" font-weight=\"600\"",
    );
    let axis = Axis::new(spectrum);
    let integers = |v: &[u32]| v.iter().map(|&x| x as f64).collect::<Vec<f64>>();
    let panels = [
        vec![
            Curve {
                values: spectrum.area.clone(),
                color: BLUE,
                name: "area",
                steps: false,
                right: false,
            },
            Curve {
                values: spectrum.volume.clone(),
                color: ORANGE,
                name: "enclosed volume",
                steps: false,
                right: true,
            },
        ],
        vec![
            Curve {
                values: integers(&spectrum.n_components),
                color: GREEN,
                name: "components",
                steps: true,
                right: false,
            },
            Curve {
                values: integers(&spectrum.n_cavities),
                color: GREY,
                name: "cavities among them",
                steps: true,
                right: false,
            },
        ],
        vec![Curve {
            values: spectrum.euler.iter().map(|&x| x as f64).collect(),
            color: PURPLE,
            name: "Euler characteristic",
            steps: true,
            right: false,
        }],
    ];
    for (n, curves) in panels.iter().enumerate() {
        panel(&mut svg, &axis, TOP + n as f64 * (PANEL + GAP), curves);
    }
    let y = TOP + 3.0 * (PANEL + GAP);
    event_rows(&mut svg, &axis, y, events);
    axis.draw(&mut svg, y + 6.0 * ROW);
    svg.push_str("</svg>\n");
    svg
}

/// The axis of isovalues.
struct Axis<'a> {
    isovalues: &'a [f64],
    low: f64,
    high: f64,
}

impl<'a> Axis<'a> {
    fn new(spectrum: &'a ContourSpectrum) -> Self {
        let isovalues = &spectrum.isovalues[..];
        let (first, last) = (isovalues[0], isovalues[isovalues.len() - 1]);
        // Isovalues are centres of intervals: half a step lies on either side.
        let half = if isovalues.len() > 1 {
            0.5 * (last - first) / (isovalues.len() - 1) as f64
        } else {
            0.5
        };
        Axis { isovalues, low: first - half, high: last + half }
    }

    fn x(&self, isovalue: f64) -> f64 {
        LEFT + (isovalue - self.low) / (self.high - self.low) * (WIDTH - LEFT - RIGHT)
    }

    fn ticks(&self) -> Vec<f64> {
        ticks(self.low, self.high, 10)
    }

    fn draw(&self, svg: &mut String, y: f64) {
        for tick in self.ticks() {
            let x = self.x(tick);
            line(svg, [x, y], [x, y + 5.0], GREY, 1.0);
            text(svg, x, y + 19.0, "middle", INK, &number(tick), "");
        }
        text(
            svg,
            0.5 * (LEFT + WIDTH - RIGHT),
            y + 40.0,
            "middle",
            INK,
            "isovalue",
            "font-weight=\"600\"",
        );
    }
}

/// A frame with curves, a scale on the left and, where a curve wants it, one on the right.
fn panel(svg: &mut String, axis: &Axis<'_>, top: f64, curves: &[Curve<'_>]) {
    let bottom = top + PANEL;
    for tick in axis.ticks() {
        line(svg, [axis.x(tick), top], [axis.x(tick), bottom], "#eceef1", 1.0);
    }
    for right in [false, true] {
        let of_side: Vec<&Curve<'_>> = curves.iter().filter(|c| c.right == right).collect();
        if of_side.is_empty() {
            continue;
        }
        let values = || of_side.iter().flat_map(|c| c.values.iter().copied());
        let low = values().fold(0.0, f64::min);
        let mut high = values().fold(0.0, f64::max);
        if high <= low {
            high = low + 1.0;
        }
        let pad = 0.06 * (high - low);
        let (low, high) = (if low < 0.0 { low - pad } else { low }, high + pad);
        let y = |v: f64| bottom - (v - low) / (high - low) * PANEL;
        for tick in ticks(low, high, 4) {
            if !right {
                line(
                    svg,
                    [LEFT, y(tick)],
                    [WIDTH - RIGHT, y(tick)],
                    if tick == 0.0 { "#c9ced6" } else { "#eceef1" },
                    1.0,
                );
            }
            let (x, anchor) =
                if right { (WIDTH - RIGHT + 8.0, "start") } else { (LEFT - 8.0, "end") };
            let color = if right { of_side[0].color } else { INK };
            text(svg, x, y(tick) + 4.0, anchor, color, &number(tick), "font-size=\"11\"");
        }
        for curve in of_side {
            polyline(svg, axis, curve, y);
        }
    }
    let _ = writeln!(
        svg,
        "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{PANEL}\" fill=\"none\" stroke=\"#c9ced6\"/>",
        WIDTH - LEFT - RIGHT
    );
    let mut x = LEFT;
    for curve in curves {
        line(svg, [x, top - 9.0], [x + 18.0, top - 9.0], curve.color, 2.5);
        let side = if curve.right { " (right axis)" } else { "" };
        let label = format!("{}{side}", curve.name);
        text(svg, x + 24.0, top - 5.0, "start", INK, &label, "");
        x += 24.0 + 6.6 * label.len() as f64 + 24.0;
    }
}

fn polyline(svg: &mut String, axis: &Axis<'_>, curve: &Curve<'_>, y: impl Fn(f64) -> f64) {
    let mut path = String::new();
    let mut last = None;
    for (&c, &v) in axis.isovalues.iter().zip(&curve.values) {
        let command = if path.is_empty() { 'M' } else { 'L' };
        if let (true, Some(previous)) = (curve.steps, last) {
            let _ = write!(path, "L{:.1} {:.1}", axis.x(c), y(previous));
        }
        let _ = write!(path, "{command}{:.1} {:.1}", axis.x(c), y(v));
        last = Some(v);
    }
    let _ = writeln!(
        svg,
        "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>",
        curve.color
    );
}

/// One row per kind: a tick where events lie, higher where there are more.
fn event_rows(svg: &mut String, axis: &Axis<'_>, top: f64, events: &[Event]) {
    text(
        svg,
        LEFT,
        top - 8.0,
        "start",
        INK,
        "events (height of a tick: logarithm of their number)",
        "",
    );
    for (row, (kind, name, color)) in KINDS.iter().enumerate() {
        let bottom = top + (row + 1) as f64 * ROW;
        let mut counts = [0u32; N_COLUMNS];
        let mut n = 0usize;
        for event in events.iter().filter(|e| e.kind == *kind) {
            let t = (event.isovalue - axis.low) / (axis.high - axis.low);
            counts[((t * N_COLUMNS as f64) as usize).min(N_COLUMNS - 1)] += 1;
            n += 1;
        }
        line(svg, [LEFT, bottom], [WIDTH - RIGHT, bottom], "#dfe3e8", 1.0);
        text(svg, LEFT - 8.0, bottom - 5.0, "end", color, name, "font-size=\"11\"");
        text(
            svg,
            WIDTH - RIGHT + 8.0,
            bottom - 5.0,
            "start",
            INK,
            &n.to_string(),
            "font-size=\"11\"",
        );
        let most = counts.iter().copied().max().unwrap_or(0);
        let mut path = String::new();
        for (column, &count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
            let x = LEFT + (column as f64 + 0.5) / N_COLUMNS as f64 * (WIDTH - LEFT - RIGHT);
            // A single event gets a third of the row.
            let share = (count as f64).ln() / (most as f64).ln().max(1.0);
            let tick = (ROW - 4.0) * (1.0 / 3.0 + 2.0 / 3.0 * share);
            let _ = write!(path, "M{x:.1} {bottom:.1}v{:.1}", -tick);
        }
        if !path.is_empty() {
            let _ = writeln!(svg, "<path d=\"{path}\" stroke=\"{color}\" stroke-width=\"1.6\"/>");
        }
    }
}

/// Round numbers from `low` to `high`, about `n` of them.
fn ticks(low: f64, high: f64, n: usize) -> Vec<f64> {
    let rough = (high - low) / n as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|s| *s >= rough)
        .unwrap_or(10.0 * power);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

/// A number without needless digits.
fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if !(1e-4..1e7).contains(&magnitude) {
        format!("{x:.1e}")
    } else {
        let text = format!("{x:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

fn line(svg: &mut String, from: [f64; 2], to: [f64; 2], color: &str, width: f64) {
    let _ = writeln!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{color}\" stroke-width=\"{width}\"/>",
        from[0], from[1], to[0], to[1]
    );
}

/// Text with the characters escaped that SVG gives a meaning.
fn text(svg: &mut String, x: f64, y: f64, anchor: &str, color: &str, content: &str, style: &str) {
    let content = content.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{color}\" {style}>{content}</text>"
    );
}
