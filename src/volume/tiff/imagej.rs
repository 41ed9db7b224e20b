//! The description that ImageJ writes: lines of `name=value`.

use super::described::{Described, Writer};
use super::planes::PlaneOrder;
use crate::volume::placement::Unit;

/// The number of the linear function among those of calibrations.
const STRAIGHT_LINE: &str = "0";

/// Reads the lines of ImageJ.
pub(super) fn read(text: &str) -> Described {
    let find = |key: &str| {
        let mut lines = text.lines().filter_map(|line| line.split_once('='));
        lines.find(|(name, _)| *name == key).map(|(_, value)| value.trim())
    };
    let count = |key: &str| find(key).and_then(|n| n.parse().ok()).filter(|&n: &usize| n > 0);
    let number = |key: &str| {
        let value = find(key).and_then(|n| n.parse::<f64>().ok());
        value.filter(|v| v.is_finite())
    };
    // Channels are the fastest, unless the writer gives an order.
    let axes = find("order").and_then(|order| {
        let order = order.to_lowercase();
        PlaneOrder::axes(order.strip_prefix("xy").unwrap_or(&order))
    });
    let order = PlaneOrder {
        n_slices: 1,
        n_channels: count("channels").unwrap_or(1),
        n_frames: count("frames").unwrap_or(1),
        axes: axes.unwrap_or(['C', 'Z', 'T']),
    };
    let calibration = match (find("cf"), number("c0"), number("c1")) {
        (Some(STRAIGHT_LINE), Some(intercept), Some(slope)) if slope != 0.0 => {
            Some((slope, intercept))
        }
        (Some(function), ..) => {
            let function = crate::volume::text::shortened(function);
            log::info!("calibration function {function} of ImageJ: samples are read as stored");
            None
        }
        _ => None,
    };
    Described {
        writer: Writer::ImageJ,
        n_pages: Some(count("images").unwrap_or(1)),
        order: Some(order),
        spacing: [None, None, number("spacing").map(f64::abs)],
        unit: find("unit").and_then(Unit::from_name).unwrap_or_default(),
        calibration,
        ..Described::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_calibration_and_unit_are_read() {
        let described = read(
            "ImageJ=1.53t\nimages=6\nchannels=2\norder=zct\nunit=µm\ncf=0\nc0=-32768.0\nc1=1.0\n",
        );
        assert_eq!(described.order.map(|order| order.axes), Some(['Z', 'C', 'T']));
        assert_eq!(described.calibration, Some((1.0, -32768.0)));
        assert_eq!(described.unit, Unit::Um);
        let plain = read("ImageJ=1.53t\nimages=6\norder=other\ncf=20\nc0=3\nc1=2\n");
        assert_eq!(plain.order.map(|order| order.axes), Some(['C', 'Z', 'T']));
        assert_eq!(plain.calibration, None);
    }
}
