//! `--keep`, `--min-volume`, `--min-area`, `--at`: which components are kept, in units and coordinates of the world.

use std::str::FromStr;

use clap::Args;
use isospectrum::spectrum::{Keep, Spectrum};

use super::heading;
use super::number_argument::not_negative;

/// Which components of the isosurface are kept, separately at each isovalue; all without any of these flags.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = heading::COMPONENTS)]
pub(super) struct KeepArguments {
    /// Keep the N components of largest enclosed volume
    ///
    /// `largest` means 1.
    #[arg(long, value_name = "N|largest")]
    keep: Option<Largest>,
    /// Leave out components of less enclosed volume
    ///
    /// In cubes of the unit of the spacing.
    #[arg(long, value_name = "VOLUME", value_parser = not_negative)]
    min_volume: Option<f64>,
    /// Leave out components of less area
    ///
    /// In squares of the unit of the spacing.
    #[arg(long, value_name = "AREA", value_parser = not_negative, hide_short_help = true)]
    min_area: Option<f64>,
    /// Keep the component nearest to this point
    ///
    /// World coordinates. Only components that the other flags keep are considered.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, hide_short_help = true)]
    at: Option<Point>,
}

impl KeepArguments {
    /// Returns the choice of components in the voxel frame, in which the meshes of a spectrum are.
    pub(super) fn of(&self, spectrum: &Spectrum) -> Keep {
        let keep = Keep {
            largest: self.keep.map(|keep| keep.0),
            min_volume: self.min_volume.unwrap_or(0.0),
            min_area: self.min_area.unwrap_or(0.0),
            at: self.at.map(|point| point.0),
        };
        keep.in_voxels(&spectrum.volume().placement)
    }
}

/// A number of components, or `largest`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Largest(usize);

impl FromStr for Largest {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = if text == "largest" { Some(1) } else { text.parse().ok() };
        let number = number.filter(|&n| n > 0).map(Largest);
        number.ok_or_else(|| "expected `largest` or a number of components".to_owned())
    }
}

/// `1,2.5,-3`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point([f64; 3]);

impl FromStr for Point {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> = (text.split(','))
            .map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        let point = numbers.and_then(|numbers| numbers.try_into().ok()).map(Point);
        point.ok_or_else(|| "expected three numbers x,y,z".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_given_by_number_or_point() {
        assert_eq!("largest".parse(), Ok(Largest(1)));
        assert_eq!("12".parse(), Ok(Largest(12)));
        assert_eq!("1, -2.5,3e1".parse(), Ok(Point([1.0, -2.5, 30.0])));
        for wrong in ["0", "-1", "most", "", "1.5"] {
            assert!(wrong.parse::<Largest>().is_err(), "{wrong}");
        }
        for wrong in ["1,2", "1,2,3,4", "1,2,x", "1,2,nan", ""] {
            assert!(wrong.parse::<Point>().is_err(), "{wrong}");
        }
    }
}
