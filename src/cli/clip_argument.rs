//! `--clip x:50%`: a plane across an axis of the volume.

use std::str::FromStr;

use isospectrum::render::Clip;
use isospectrum::spectrum::VolumeInfo;
use isospectrum::volume::Placement;

/// `[-]AXIS:PLACE`: what lies beyond the place is left out, with `-` what lies before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClipArgument {
    axis: usize,
    is_turned: bool,
    place: Place,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Share of the volume's length, 0 to 1.
    Share(f64),
    /// Length from the first sample, in the unit of the volume.
    Length(f64),
}

impl ClipArgument {
    /// The plane in the voxel frame of a volume.
    pub(super) fn of(self, volume: &VolumeInfo) -> Clip {
        self.of_grid(volume.dims, &volume.placement)
    }

    /// The same of so many samples that lie somewhere.
    pub(super) fn of_grid(self, dims: [usize; 3], placement: &Placement) -> Clip {
        let ClipArgument { axis, is_turned, place } = self;
        let world = match place {
            Place::Share(share) => share * (dims[axis] as f64 - 1.0) * placement.spacing[axis],
            Place::Length(length) => length,
        };
        let sign = if is_turned { -1.0 } else { 1.0 };
        let mut normal = [0.0; 3];
        normal[axis] = sign;
        Clip { normal, offset: sign * world / placement.voxel() }
    }
}

impl FromStr for ClipArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}', expected an axis and a place such as x:50%, -z:12.5");
        let (rest, is_turned) = match text.trim().strip_prefix('-') {
            Some(rest) => (rest, true),
            None => (text.trim(), false),
        };
        let (axis, place) = rest.split_once(':').ok_or_else(wrong)?;
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis).ok_or_else(wrong)?;
        let number = |digits: &str| digits.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let place = match place.strip_suffix('%') {
            Some(percent) => {
                let share = number(percent).filter(|p| (0.0..=100.0).contains(p));
                Place::Share(share.ok_or_else(wrong)? / 100.0)
            }
            None => Place::Length(number(place).ok_or_else(wrong)?),
        };
        Ok(ClipArgument { axis, is_turned, place })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_has_an_axis_a_side_and_a_place() {
        let of = |text: &str| text.parse::<ClipArgument>().ok();
        let clip = |axis, is_turned, place| Some(ClipArgument { axis, is_turned, place });
        assert_eq!(of("x:50%"), clip(0, false, Place::Share(0.5)));
        assert_eq!(of("-z:12.5"), clip(2, true, Place::Length(12.5)));
        for wrong in ["", "x", "w:5", "x:101%", "x:", "x:nan", "5"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
