//! What is written on a picture: the legend of its colours, axes, a scale bar, a label.
//!
//! Drawn on the finished picture, in pixels, with the font of the window (Ubuntu Light, Ubuntu font licence).

mod axes;

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

use super::{Background, FIELD_OF_VIEW, Image, View};
use crate::color::{Attribute, Map, Scale, to_srgb};
use crate::render::projection::Projection;
use crate::volume::{Placement, Unit};

/// Height of letters as a share of the picture's, and the least that is read, pixels.
const LETTERS: f32 = 0.026;
const LEAST_LETTERS: f32 = 12.0;

/// Longest scale bar and legend as shares of the picture's width.
const LONGEST_BAR: f64 = 0.25;
const LEGEND: f32 = 0.32;

/// Components that a legend names.
const MOST_NAMES: u32 = 8;

/// Where words stand of the point that they are put at.
#[derive(Clone, Copy)]
enum Stand {
    Left,
    Middle,
    Right,
}

/// A picture that is written on.
pub(super) struct Sheet<'a> {
    image: &'a mut Image,
    font: FontRef<'static>,
    letters: f32,
    ink: [u8; 3],
}

impl<'a> Sheet<'a> {
    /// For words that are seen on a background.
    pub(super) fn new(image: &'a mut Image, background: Background) -> Self {
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).expect("a font");
        let letters = (LETTERS * image.height as f32).max(LEAST_LETTERS);
        let ink = if background == Background::Dark { [230, 232, 236] } else { [24, 28, 34] };
        Sheet { image, font, letters, ink }
    }

    /// Writes all that a view asks for; `shown` is what its colours show.
    pub(super) fn write(
        &mut self,
        view: &View,
        placement: &Placement,
        projection: &Projection,
        shown: Option<(&Attribute, Map)>,
    ) {
        if let Some(label) = &view.label {
            self.words(label, [self.margin(), self.margin()], Stand::Left, 1.25);
        }
        if let Some((attribute, map)) = shown.filter(|_| view.legend) {
            match attribute.scale {
                Some(scale) => self.legend(&attribute.name, scale, map),
                None => self.names(attribute),
            }
        }
        if view.axes {
            self.axes(placement, projection, view.background);
        }
        if view.scale_bar {
            self.scale_bar(placement, projection);
        }
    }

    fn margin(&self) -> f32 {
        self.letters
    }

    /// The map as a bar with its ends and its middle, at the bottom on the left, with the name above.
    fn legend(&mut self, name: &str, scale: Scale, map: Map) {
        let length = (LEGEND * self.image.width as f32).round();
        let [x, below] = [self.margin().round(), self.image.height as f32 - 2.4 * self.letters];
        let thick = (0.6 * self.letters).round();
        let y = (below - thick).round();
        for column in 0..length as u32 {
            let color = map.at((column as f32 + 0.5) / length).map(to_srgb);
            self.fill([x + column as f32, y], [1.0, thick], color);
        }
        let middle = 0.5 * scale.low + 0.5 * scale.high;
        let step = scale.high - scale.low;
        for (share, value, stand) in [
            (0.0, scale.low, Stand::Left),
            (0.5, middle, Stand::Middle),
            (1.0, scale.high, Stand::Right),
        ] {
            let tick = (x + share * (length - 1.0)).round();
            self.fill([tick, y + thick], [1.0, 0.25 * self.letters], self.ink);
            let at = [tick, y + thick + 0.3 * self.letters];
            self.words(&shown_number(value, step), at, stand, 1.0);
        }
        self.words(name, [x, y - 1.35 * self.letters], Stand::Left, 1.0);
    }

    /// The colours of the first components, by their numbers.
    fn names(&mut self, attribute: &Attribute) {
        let most = attribute.values.iter().copied().fold(0.0f32, f32::max) as u32 + 1;
        let side = (0.8 * self.letters).round();
        let y = (self.image.height as f32 - 2.2 * self.letters).round();
        let mut x = self.margin().round();
        for number in 0..most.min(MOST_NAMES) {
            let color = attribute.color_of(number as f32, Map::Viridis).map(to_srgb);
            self.fill([x, y], [side, side], color);
            let end = self.words(
                &(number + 1).to_string(),
                [x + 1.3 * side, y - 0.2 * side],
                Stand::Left,
                1.0,
            );
            x = (end + side).round();
        }
        let y = y - 1.5 * self.letters;
        self.words(&attribute.name, [self.margin(), y], Stand::Left, 1.0);
    }

    /// A bar of a round length at the distance of the point looked at, at the bottom on the right.
    fn scale_bar(&mut self, placement: &Placement, projection: &Projection) {
        let tan = (0.5 * FIELD_OF_VIEW).to_radians().tan();
        let per_pixel =
            2.0 * tan * projection.distance * placement.voxel() / f64::from(self.image.height);
        let length = round_length(LONGEST_BAR * f64::from(self.image.width) * per_pixel);
        let pixels = (length / per_pixel) as f32;
        let end = self.image.width as f32 - self.margin();
        let y = (self.image.height as f32 - self.margin() - 2.0).round();
        let tick = (0.4 * self.letters).round();
        self.fill([end - pixels, y], [pixels, 2.0], self.ink);
        for x in [end - pixels, end - 2.0] {
            self.fill([x, y - tick], [2.0, tick], self.ink);
        }
        let unit = match placement.unit {
            Unit::Unknown => String::new(),
            Unit::Um => " µm".to_owned(),
            Unit::Angstrom => " Å".to_owned(),
            unit => format!(" {unit}"),
        };
        let words = format!("{}{unit}", shown_number(length, length));
        let at = [end - 0.5 * pixels, y - 1.3 * self.letters];
        self.words(&words, at, Stand::Middle, 1.0);
    }

    /// Writes words whose top is at `at`, larger by `scale`; returns where they end.
    fn words(&mut self, text: &str, at: [f32; 2], stand: Stand, scale: f32) -> f32 {
        let size = PxScale::from(scale * self.letters);
        let font = self.font.clone();
        let scaled = font.as_scaled(size);
        let mut glyphs: Vec<Glyph> = Vec::new();
        let mut width = 0.0;
        for c in text.chars() {
            let id = scaled.glyph_id(c);
            if let Some(before) = glyphs.last() {
                width += scaled.kern(before.id, id);
            }
            glyphs.push(id.with_scale_and_position(size, point(width, 0.0)));
            width += scaled.h_advance(id);
        }
        let left = match stand {
            Stand::Left => at[0],
            Stand::Middle => at[0] - 0.5 * width,
            Stand::Right => at[0] - width,
        };
        // Words that would leave the picture are moved back into it.
        let left = left.min(self.image.width as f32 - width).max(0.0);
        let baseline = at[1] + scaled.ascent();
        for mut glyph in glyphs {
            glyph.position.x += left;
            glyph.position.y = baseline;
            if let Some(outline) = font.outline_glyph(glyph) {
                let low = outline.px_bounds().min;
                outline.draw(|x, y, cover| {
                    let (x, y) = (low.x as i64 + i64::from(x), low.y as i64 + i64::from(y));
                    self.put(x, y, self.ink, cover);
                });
            }
        }
        left + width
    }

    /// A filled rectangle, of whole pixels.
    fn fill(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2], color: [u8; 3]) {
        let [x, y] = [x, y].map(|c| c.round() as i64);
        for row in y..y + (height.round() as i64).max(1) {
            for column in x..x + (width.round() as i64).max(1) {
                self.put(column, row, color, 1.0);
            }
        }
    }

    /// Lays a colour over a pixel, as far as it covers it.
    fn put(&mut self, x: i64, y: i64, color: [u8; 3], cover: f32) {
        let (width, height) = (i64::from(self.image.width), i64::from(self.image.height));
        if !(0..width).contains(&x) || !(0..height).contains(&y) || cover <= 0.0 {
            return;
        }
        let at = 4 * (y * width + x) as usize;
        let pixel = &mut self.image.pixels[at..at + 4];
        let cover = cover.min(1.0);
        let below = f32::from(pixel[3]) / 255.0 * (1.0 - cover);
        let alpha = cover + below;
        for (byte, over) in pixel.iter_mut().zip(color) {
            let mixed = (cover * f32::from(over) + below * f32::from(*byte)) / alpha;
            *byte = mixed.round() as u8;
        }
        pixel[3] = (255.0 * alpha).round() as u8;
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not longer.
fn round_length(longest: f64) -> f64 {
    let decade = 10f64.powf(longest.log10().floor());
    [5.0, 2.0].into_iter().map(|n| n * decade).find(|&n| n <= longest).unwrap_or(decade)
}

/// A number by as many digits as tell it from others a thousandth of `step` away.
fn shown_number(x: f64, step: f64) -> String {
    let digits = (3.0 - step.abs().log10().floor()).clamp(-300.0, 300.0);
    if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) {
        return format!("{x:.2e}");
    }
    let text = format!("{x:.*}", digits.max(0.0) as usize);
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_as_many_digits_as_the_step_needs() {
        assert_eq!(shown_number(0.5, 1.0), "0.5");
        assert_eq!(shown_number(-0.0001, 1.0), "-1.00e-4");
        assert_eq!(shown_number(127.5, 255.0), "127.5");
        assert_eq!(shown_number(1200.0, 3000.0), "1200");
        assert_eq!(shown_number(2e-9, 1e-9), "2.00e-9");
        assert_eq!(shown_number(0.0, 1.0), "0");
    }

    #[test]
    fn lengths_are_round_and_not_too_long() {
        for (longest, expected) in
            [(7.3, 5.0), (4.9, 2.0), (1.2, 1.0), (0.03, 0.02), (100.0, 100.0)]
        {
            assert!((round_length(longest) - expected).abs() < 1e-12 * expected, "{longest}");
        }
    }

    #[test]
    fn words_are_seen_and_stay_in_the_picture() {
        let blank = |alpha: u8| Image {
            width: 120,
            height: 40,
            pixels: [255, 255, 255, alpha].repeat(120 * 40),
        };
        for stand in [Stand::Left, Stand::Middle, Stand::Right] {
            let mut image = blank(255);
            let end = Sheet::new(&mut image, Background::White).words(
                "0.25 mm",
                [110.0, 10.0],
                stand,
                1.0,
            );
            assert!(end <= 120.0);
            // Strokes are about a pixel wide, so few pixels have all of the ink.
            let inked = image.pixels.chunks_exact(4).filter(|p| p[0] < 200).count();
            assert!((40..800).contains(&inked), "{inked} pixels with ink");
        }
        // Where nothing is behind them they have a colour of their own.
        let mut image = blank(0);
        Sheet::new(&mut image, Background::Transparent).fill([2.0, 2.0], [3.0, 3.0], [1, 2, 3]);
        assert_eq!(image.pixel(3, 3), [1, 2, 3, 255]);
        assert_eq!(image.pixel(9, 9)[3], 0);
    }
}
