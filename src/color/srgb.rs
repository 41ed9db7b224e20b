//! Colour spaces: sRGB (IEC 61966-2-1), linear light, and OKLCh; colours that do not come from a map.

/// Linear red, green and blue of missing values, for example outside of a field.
pub(super) const NO_VALUE: [f32; 3] = [0.30, 0.30, 0.30];

/// Linear red, green and blue of a component by its index; the twin of `component_color` in `shaders/surface.wgsl`.
pub(super) fn component_color(index: u32) -> [f32; 3] {
    const HUES: [f32; 8] = [245.0, 60.0, 165.0, 350.0, 95.0, 220.0, 35.0, 310.0];
    const LIGHTNESS: [f32; 8] = [0.58, 0.74, 0.66, 0.64, 0.87, 0.80, 0.58, 0.48];
    let turn = (index % 8) as usize;
    let round = ((index / 8) % 3) as f32;
    from_oklch(LIGHTNESS[turn] * (1.0 - 0.13 * round), 0.125, HUES[turn].to_radians())
}

/// Linear intensity of an sRGB byte.
pub(crate) fn to_linear(byte: u8) -> f32 {
    let s = f32::from(byte) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// Linear red, green and blue of an sRGB colour, 0xrrggbb.
pub fn linear(color: u32) -> [f32; 3] {
    [16, 8, 0].map(|bits| to_linear((color >> bits & 0xff) as u8))
}

/// The sRGB byte of a linear intensity.
pub fn to_srgb(linear: f32) -> u8 {
    let c = linear.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

/// Linear sRGB of a colour in OKLCh (Ottosson 2020, "A perceptual color space for image processing"); hue in radians.
fn from_oklch(lightness: f32, chroma: f32, hue: f32) -> [f32; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let [l, m, s] = [
        lightness + 0.396_337_78 * a + 0.215_803_76 * b,
        lightness - 0.105_561_346 * a - 0.063_854_17 * b,
        lightness - 0.089_484_18 * a - 1.291_485_5 * b,
    ]
    .map(|x| x * x * x);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
    .map(|x: f32| x.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes_survive_a_round_trip() {
        for byte in 0..=255 {
            assert_eq!(to_srgb(to_linear(byte)), byte);
        }
    }

    #[test]
    fn a_chroma_of_zero_is_grey() {
        let [r, g, b] = from_oklch(0.5, 0.0, 1.0);
        assert!((r - 0.125).abs() < 1e-4 && (g - r).abs() < 1e-4 && (b - r).abs() < 1e-4);
    }
}
