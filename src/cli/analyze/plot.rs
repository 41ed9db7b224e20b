//! The curves as SVG: one panel each over a common axis of isovalues.

use std::fmt::Write as _;

use super::super::report::number;
use super::curves::Curve;

const WIDTH: f64 = 720.0;
const PANEL: f64 = 120.0;
const LEFT: f64 = 90.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 40.0;
const GAP: f64 = 24.0;

/// Title of a panel and its value at an isovalue.
type Panel = (&'static str, fn(&Curve) -> f64);

const PANELS: [Panel; 4] = [
    ("components", |c| c.components as f64),
    ("handles", |c| c.handles as f64),
    ("area without caps", |c| c.area),
    ("enclosed volume", |c| c.enclosed_volume),
];

/// Returns the plot of the curves of a volume as SVG.
pub(super) fn svg(name: &str, curves: &[Curve]) -> String {
    let height = TOP + PANELS.len() as f64 * (PANEL + GAP) + GAP;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"22\" font-size=\"15\">{}</text>\n",
        escaped(name)
    );
    for (i, panel) in PANELS.iter().enumerate() {
        write_panel(&mut svg, TOP + i as f64 * (PANEL + GAP), panel, curves);
    }
    if let (Some(first), Some(last)) = (curves.first(), curves.last()) {
        let (y, right) = (height - GAP + 8.0, WIDTH - RIGHT);
        write_text(&mut svg, LEFT, y, "start", &number(first.isovalue));
        write_text(&mut svg, 0.5 * (LEFT + right), y, "middle", "isovalue");
        write_text(&mut svg, right, y, "end", &number(last.isovalue));
    }
    svg += "</svg>\n";
    svg
}

fn write_panel(svg: &mut String, top: f64, &(title, value): &Panel, curves: &[Curve]) {
    let largest = curves.iter().map(value).fold(0.0, f64::max);
    let scale = if largest > 0.0 { PANEL / largest } else { 0.0 };
    let width = WIDTH - LEFT - RIGHT;
    let step = width / (curves.len().max(2) - 1) as f64;
    let points: Vec<String> = curves
        .iter()
        .enumerate()
        .map(|(i, c)| {
            let (x, y) = (LEFT + i as f64 * step, top + PANEL - value(c) * scale);
            format!("{x:.1},{y:.1}")
        })
        .collect();
    // Writing to a String does not fail.
    let _ = writeln!(
        svg,
        "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{width}\" height=\"{PANEL}\" fill=\"none\" stroke=\"#999\"/>\n\
         <polyline points=\"{}\" fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"1.5\"/>",
        points.join(" ")
    );
    write_text(svg, LEFT + 6.0, top + 15.0, "start", title);
    write_text(svg, LEFT - 6.0, top + 10.0, "end", &number(largest));
    write_text(svg, LEFT - 6.0, top + PANEL, "end", "0");
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
    fn every_panel_has_one_point_per_isovalue_inside_the_picture() {
        let curve = |x: f64| Curve {
            isovalue: x,
            components: 2,
            handles: 0,
            euler: 4,
            area: x * x,
            enclosed_volume: x,
        };
        let name = "a<b\u{1}\u{85}\u{ffff}\t";
        let picture = svg(name, &[curve(0.0), curve(1.0), curve(2.0)]);
        assert!(picture.contains(">a&lt;b\u{fffd}\u{fffd}\u{fffd}\u{fffd}<"));
        let lines: Vec<&str> = picture.split("points=\"").skip(1).collect();
        assert_eq!(lines.len(), PANELS.len());
        for line in lines {
            let points: Vec<&str> = line.split('"').next().unwrap_or_default().split(' ').collect();
            assert_eq!(points.len(), 3);
            assert!(
                points[0].starts_with("90.0,") && points[2].starts_with("700.0,"),
                "{points:?}"
            );
        }
    }
}
