//! The curves as SVG: one panel each over a common axis of isovalues, with ticks at events below them.

use std::fmt::Write as _;

use super::super::report::number;
use super::curves::Curve;

const WIDTH: f64 = 720.0;
const PANEL: f64 = 110.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 56.0;
const GAP: f64 = 26.0;

/// Height of the ticks at events.
const EVENTS: f64 = 9.0;

/// Largest number of steps along an axis.
const MAX_STEPS: [f64; 2] = [8.0, 4.0];

/// The isovalues of a plot, at least: one for each pixel of a narrow column of a page.
pub(super) const MIN_SAMPLES: usize = 512;

/// A panel: its title, the power of the unit of length in its values, its colour, its value at an isovalue, and whether that is a count.
struct Panel {
    title: &'static str,
    power: &'static str,
    color: &'static str,
    value: fn(&Curve) -> f64,
    is_count: bool,
}

/// The panels; colours are those of the page and the window.
const PANELS: [Panel; 4] = [
    Panel {
        title: "Area without caps",
        power: "²",
        color: "#2f6ea8",
        value: |c| c.area,
        is_count: false,
    },
    Panel {
        title: "Volume",
        power: "³",
        color: "#a3467c",
        value: |c| c.enclosed_volume,
        is_count: false,
    },
    Panel {
        title: "Components",
        power: "",
        color: "#b4560a",
        value: |c| c.components as f64,
        is_count: true,
    },
    Panel {
        title: "Handles",
        power: "",
        color: "#4c7a34",
        value: |c| c.handles as f64,
        is_count: true,
    },
];

/// What a plot shows.
pub(super) struct Plot<'a> {
    pub(super) name: &'a str,
    /// The unit of length.
    pub(super) unit: &'a str,
    /// At least two isovalues, ascending, the ends of the range among them.
    pub(super) curves: &'a [Curve],
    /// The isovalues of events.
    pub(super) events: &'a [f64],
}

impl Plot<'_> {
    /// Returns the plot as SVG.
    pub(super) fn svg(&self) -> String {
        let height = TOP + PANELS.len() as f64 * (PANEL + GAP) + EVENTS + 24.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#1b1e23\">\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
             <text x=\"{LEFT}\" y=\"20\" font-size=\"15\">{}</text>\n",
            escaped(self.name)
        );
        for (i, panel) in PANELS.iter().enumerate() {
            self.write_panel(&mut svg, TOP + i as f64 * (PANEL + GAP), panel);
        }
        let bottom = TOP + PANELS.len() as f64 * (PANEL + GAP) - GAP;
        let ticks: String = (self.events.iter())
            .map(|&c| format!("M{:.1},{:.1}v{EVENTS}", self.x(c), bottom + 3.0))
            .collect();
        // Writing to a String does not fail.
        let _ = writeln!(
            svg,
            "<path class=\"events\" d=\"{ticks}\" stroke=\"#1b1e23\" stroke-width=\"0.7\"/>"
        );
        write_text(&mut svg, LEFT - 6.0, bottom + 11.0, "end", "events");
        let (low, high) = self.range();
        for c in round_numbers(low, high, MAX_STEPS[0]) {
            write_text(&mut svg, self.x(c), bottom + EVENTS + 18.0, "middle", &number(c));
        }
        write_text(
            &mut svg,
            0.5 * (LEFT + WIDTH - RIGHT),
            bottom + EVENTS + 36.0,
            "middle",
            "Isovalue",
        );
        svg += "</svg>\n";
        svg
    }

    fn range(&self) -> (f64, f64) {
        let at = |curve: Option<&Curve>| curve.map_or(0.0, |c| c.isovalue);
        (at(self.curves.first()), at(self.curves.last()))
    }

    fn x(&self, isovalue: f64) -> f64 {
        let (low, high) = self.range();
        let share = if high > low { (isovalue - low) / (high - low) } else { 0.5 };
        LEFT + share.clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT)
    }

    fn write_panel(&self, svg: &mut String, top: f64, panel: &Panel) {
        let values = || self.curves.iter().map(panel.value);
        let (least, most) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let ticks =
            round_numbers(least, if most > least { most } else { least + 1.0 }, MAX_STEPS[1]);
        let step = ticks.get(1).map_or(1.0, |second| second - ticks[0]);
        // The scale ends with a round number.
        let last = ticks[ticks.len() - 1];
        let end = if last < most { last + step } else { last };
        let y = |value: f64| top + PANEL * (1.0 - (value - ticks[0]) / (end - ticks[0]));
        let right = WIDTH - RIGHT;
        for &tick in ticks.iter().chain((end > last).then_some(&end)) {
            let at = y(tick);
            let _ = writeln!(svg, "<path d=\"M{LEFT},{at:.1}H{right}\" stroke=\"#e3e5e9\"/>");
            write_text(svg, LEFT - 6.0, at + 4.0, "end", &number(tick));
        }
        let mut line = String::new();
        for (i, curve) in self.curves.iter().enumerate() {
            let (x, y) = (self.x(curve.isovalue), y((panel.value)(curve)));
            let _ = match (i, panel.is_count) {
                (0, _) => write!(line, "M{x:.1},{y:.1}"),
                (_, true) => write!(line, "H{x:.1}V{y:.1}"),
                (_, false) => write!(line, "L{x:.1},{y:.1}"),
            };
        }
        let _ = writeln!(
            svg,
            "<path class=\"curve\" d=\"{line}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\" stroke-linejoin=\"round\"/>",
            panel.color
        );
        let unit = if panel.power.is_empty() {
            String::new()
        } else {
            format!(", {}{}", self.unit, panel.power)
        };
        write_text(svg, LEFT, top - 7.0, "start", &format!("{}{unit}", panel.title));
    }
}

/// Round numbers from the last one not above `low` to the last one not above `high`, at most `n` steps; at least one number.
fn round_numbers(low: f64, high: f64, n: f64) -> Vec<f64> {
    let least = (high - low) / n;
    let decade = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|x| x * decade).into_iter().find(|&x| x >= least);
    let Some(step) = step.filter(|step| step.is_finite() && *step > 0.0) else { return vec![low] };
    let (first, last) = ((low / step).floor(), (high / step).floor());
    let count = (last - first).clamp(0.0, n + 1.0) as usize;
    (0..=count).map(|i| (first + i as f64) * step).collect()
}

fn write_text(svg: &mut String, x: f64, y: f64, anchor: &str, text: &str) {
    let text = escaped(text);
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
}

/// Escapes text for an element. XML has no control characters, nor U+FFFE and U+FFFF.
fn escaped(text: &str) -> String {
    let is_xml = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    let text: String = text.chars().map(|c| if is_xml(c) { c } else { '\u{fffd}' }).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_steps_measures_are_lines_and_events_have_ticks() {
        let curve = |x: f64| Curve {
            isovalue: x,
            components: 2,
            handles: 0,
            euler: 4,
            area: x * x,
            enclosed_volume: x,
        };
        let curves = [curve(0.0), curve(1.0), curve(2.0)];
        let name = "a<b\u{1}\u{85}\u{ffff}\t";
        let picture = Plot { name, unit: "mm", curves: &curves, events: &[0.0, 2.0] }.svg();
        assert!(picture.contains(">a&lt;b\u{fffd}\u{fffd}\u{fffd}\u{fffd}<"));
        assert!(picture.contains(">Area without caps, mm²<") && picture.contains(">Components<"));
        let lines: Vec<&str> = picture.split("class=\"curve\" d=\"").skip(1).collect();
        assert_eq!(lines.len(), PANELS.len());
        for (line, panel) in lines.iter().zip(PANELS) {
            let line = line.split('"').next().unwrap_or_default();
            assert!(line.starts_with("M78.0,"), "{line}");
            let parts =
                if panel.is_count { line.matches('H').count() } else { line.matches('L').count() };
            assert_eq!(parts, 2, "{line}");
            assert!(line.contains(if panel.is_count { "H702.0V" } else { "L702.0," }), "{line}");
        }
        let ticks = picture.split("class=\"events\" d=\"").nth(1).expect("ticks");
        assert!(ticks.starts_with("M78.0,") && ticks.contains("M702.0,"), "{ticks}");
    }

    #[test]
    fn round_numbers_cover_a_range() {
        assert_eq!(round_numbers(0.0, 249.0, 8.0), [0.0, 50.0, 100.0, 150.0, 200.0]);
        assert_eq!(round_numbers(-3.0, 5.0, 4.0), [-4.0, -2.0, 0.0, 2.0, 4.0]);
        assert_eq!(round_numbers(0.0, 1.0, 4.0), [0.0, 0.5, 1.0]);
        assert_eq!(round_numbers(7.0, 7.0, 4.0), [7.0]);
    }
}
