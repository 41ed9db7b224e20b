//! Colour maps: published, perceptually uniform tables.
//!
//! # Theory
//!
//! Equal steps of the value are equal perceptual steps, with any colour vision and in greyscale (van der Walt and Smith 2015;
//! Nuñez, Anderton and Renslow 2018; Crameri 2018). `maps.txt` has 33 of the 256 colours of each map; interpolated linearly
//! in linear light, no channel is off by more than 3 of 255 (6 in cividis).

use std::sync::LazyLock;

use super::srgb::linear;
use crate::parse_name::named_values;

/// Number of tabulated colours of a map.
pub(crate) const N_STOPS: usize = 33;

/// A colour map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Map {
    /// Violet over teal to yellow.
    #[default]
    Viridis,
    /// Blue over grey to yellow: looks the same with red-green colour blindness.
    Cividis,
    /// Black over purple to light yellow.
    Magma,
    /// Black over red to light yellow.
    Inferno,
    /// Blue over red to yellow.
    Plasma,
    /// Diverging: blue below, brown above, nearly white in the middle.
    Vik,
}

impl Map {
    /// The tabulated colours, evenly spaced, 0xrrggbb in sRGB.
    pub(crate) fn stops(self) -> &'static [u32; N_STOPS] {
        &TABLES[self as usize]
    }

    /// The tabulated colours as text, six hexadecimal digits each.
    pub(crate) fn codes(self) -> Vec<String> {
        self.stops().iter().map(|code| format!("{code:06x}")).collect()
    }

    /// Linear red, green and blue of the tabulated colours.
    pub(crate) fn linear_stops(self) -> [[f32; 3]; N_STOPS] {
        self.stops().map(linear)
    }

    /// Linear red, green and blue at a fraction of the map, 0 to 1; the twin of `map_color` in `shaders/surface.wgsl`.
    pub fn at(self, fraction: f32) -> [f32; 3] {
        let x = fraction.clamp(0.0, 1.0) * (N_STOPS - 1) as f32;
        let before = (x as usize).min(N_STOPS - 2);
        let [a, b] = [before, before + 1].map(|i| linear(self.stops()[i]));
        let t = x - before as f32;
        std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i])
    }
}

named_values! {
    Map, "color map":
    Viridis = "viridis",
    Cividis = "cividis",
    Magma = "magma",
    Inferno = "inferno",
    Plasma = "plasma",
    Vik = "vik",
}

/// The tables of `maps.txt`, in the order of [`Map::ALL`].
static TABLES: LazyLock<[[u32; N_STOPS]; 6]> = LazyLock::new(|| {
    Map::ALL.map(|map| {
        let line = include_str!("maps.txt")
            .lines()
            .find_map(|line| line.strip_prefix(map.name())?.strip_prefix(' '))
            .expect("a table for every map");
        let mut stops = line.split(' ').map(|code| u32::from_str_radix(code, 16).expect("a color"));
        std::array::from_fn(|_| stops.next().expect("33 colors"))
    })
});

#[cfg(test)]
mod tests {
    use super::*;

    /// Lightness L* of a linear colour (CIE 1976).
    fn lightness([r, g, b]: [f32; 3]) -> f32 {
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    #[test]
    fn sequential_maps_brighten_uniformly_and_the_diverging_map_is_lightest_in_its_middle() {
        for map in Map::ALL {
            let light: Vec<f32> = (0..=64).map(|i| lightness(map.at(i as f32 / 64.0))).collect();
            if map == Map::Vik {
                let lightest = (0..=64).max_by(|&i, &j| light[i].total_cmp(&light[j]));
                assert_eq!(lightest, Some(32));
                continue;
            }
            // Rounded to bytes, the darkest colours are a tenth of a unit of lightness off the line.
            assert!(light.windows(2).all(|w| w[1] > w[0] - 0.1), "{}: {light:?}", map.name());
            let mean = (light[64] - light[0]) / 64.0;
            let steps = light.windows(2).map(|w| w[1] - w[0]);
            // No step is a visible jump.
            let max = steps.fold(0.0, f32::max);
            assert!(max < 2.5 * mean, "{}: {max} of {mean}", map.name());
        }
    }

    #[test]
    fn ends_and_middles_are_the_published_colors() {
        let bytes = |map: Map, i: usize| map.stops()[i];
        assert_eq!([bytes(Map::Viridis, 0), bytes(Map::Viridis, 32)], [0x44_0154, 0xfd_e725]);
        assert_eq!(bytes(Map::Viridis, 16), 0x21_908c);
        assert_eq!([bytes(Map::Vik, 0), bytes(Map::Vik, 16)], [0x00_1261, 0xec_e5e1]);
        for map in Map::ALL {
            assert_eq!(map.name().parse::<Map>().expect("a map"), map);
            assert_eq!(map.at(-1.0), linear(map.stops()[0]));
            assert_eq!(map.at(2.0), linear(map.stops()[32]));
        }
        assert!("jet".parse::<Map>().is_err());
    }
}
