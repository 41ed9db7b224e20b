//! `--keep`, `--min-volume`, `--min-area`, `--at`: which components are kept, in the unit and the frame of the world.

use std::str::FromStr;

use clap::Args;
use isospectrum::spectrum::{Keep, Spectrum};

use super::compute::not_negative;

/// Which components of the isosurface are kept, at each isovalue by itself; without any of these all are
#[derive(Args, Clone, Debug, Default)]
pub(super) struct KeepArguments {
    /// Keep this many components, the largest by enclosed volume; `largest` is 1
    #[arg(long, value_name = "N|largest")]
    keep: Option<Largest>,
    /// Leave out components that enclose less volume than this, cubes of the unit of the spacing
    #[arg(long, value_name = "VOLUME", value_parser = not_negative, allow_negative_numbers = true)]
    min_volume: Option<f64>,
    /// Leave out components of less area than this, squares of the unit of the spacing
    #[arg(long, value_name = "AREA", value_parser = not_negative, allow_negative_numbers = true)]
    min_area: Option<f64>,
    /// Keep the component alone whose surface is nearest to this point of the world, of those that are large enough
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    at: Option<Point>,
}

impl KeepArguments {
    /// What is kept of a spectrum's meshes, which are in the voxel frame.
    pub(super) fn of(&self, spectrum: &Spectrum) -> Keep {
        let told = Keep {
            largest: self.keep.map(|keep| keep.0),
            min_volume: self.min_volume.unwrap_or(0.0),
            min_area: self.min_area.unwrap_or(0.0),
            at: self.at.map(|point| point.0),
        };
        told.in_voxels(&spectrum.volume().placement)
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
        number.ok_or_else(|| format!("'{text}', expected largest or a number of components"))
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
        point.ok_or_else(|| format!("'{text}', expected three numbers x,y,z"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_points_are_read() {
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
