//! `--clip x:50%`: a clip plane across an axis of the volume.

use std::str::FromStr;

use isospectrum::render::Clip;
use isospectrum::spectrum::VolumeInfo;
use isospectrum::volume::Placement;

/// `[-]AXIS:POSITION`: leaves out what is beyond the position, with `-` what is before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClipArgument {
    axis: usize,
    is_flipped: bool,
    position: Position,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Position {
    /// Fraction of the length of the volume, 0 to 1.
    Share(f64),
    /// Length from the first sample, in the unit of the volume.
    Length(f64),
}

impl ClipArgument {
    /// Returns the plane in the voxel frame of a volume.
    pub(super) fn of(self, volume: &VolumeInfo) -> Clip {
        self.of_grid(volume.dims, &volume.placement)
    }

    /// Returns the plane in the voxel frame of a grid.
    pub(super) fn of_grid(self, dims: [usize; 3], placement: &Placement) -> Clip {
        let ClipArgument { axis, is_flipped, position } = self;
        let samples = match position {
            Position::Share(share) => share * (dims[axis] as f64 - 1.0),
            Position::Length(length) => length / placement.spacing[axis],
        };
        let sign = if is_flipped { -1.0 } else { 1.0 };
        let mut normal = [0.0; 3];
        normal[axis] = sign;
        Clip { normal, offset: sign * samples * placement.cell_size()[axis] }
    }
}

impl FromStr for ClipArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected an axis and a position such as x:50% or -z:12.5".to_owned();
        let (rest, is_flipped) = match text.trim().strip_prefix('-') {
            Some(rest) => (rest, true),
            None => (text.trim(), false),
        };
        let (axis, position) = rest.split_once(':').ok_or_else(wrong)?;
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis).ok_or_else(wrong)?;
        let number = |digits: &str| digits.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let position = match position.strip_suffix('%') {
            Some(percent) => {
                let share = number(percent).filter(|p| (0.0..=100.0).contains(p));
                Position::Share(share.ok_or_else(wrong)? / 100.0)
            }
            None => Position::Length(number(position).ok_or_else(wrong)?),
        };
        Ok(ClipArgument { axis, is_flipped, position })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_has_an_axis_a_side_and_a_position() {
        let of = |text: &str| text.parse::<ClipArgument>().ok();
        let clip = |axis, is_flipped, position| Some(ClipArgument { axis, is_flipped, position });
        assert_eq!(of("x:50%"), clip(0, false, Position::Share(0.5)));
        assert_eq!(of("-z:12.5"), clip(2, true, Position::Length(12.5)));
        for wrong in ["", "x", "w:5", "x:101%", "x:", "x:nan", "5"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
