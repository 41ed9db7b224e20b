//! Annotations of a picture: the legend of its colours, axes, a scale bar, a label.
//!
//! They are drawn onto the finished picture, in pixels, with the font of the window (Ubuntu Light, Ubuntu font licence).

mod axes;

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

use super::background::Background;
use super::camera::FIELD_OF_VIEW;
use super::image::Image;
use super::projection::Projection;
use super::view::View;
use crate::color::{Attribute, Map, Scale, to_srgb};
use crate::volume::{Placement, Unit};

/// Font size as a fraction of the picture's height, and its minimum, pixels.
const FONT_SIZE: f32 = 0.026;
const MIN_FONT_SIZE: f32 = 12.0;

/// Maximum length of the scale bar and length of the legend, as fractions of the picture's width.
const MAX_BAR_LENGTH: f64 = 0.25;
const LEGEND_LENGTH: f32 = 0.32;

/// Maximum number of components in a legend.
const MAX_LEGEND_COMPONENTS: u32 = 8;

/// Horizontal alignment of text at a point.
#[derive(Clone, Copy)]
enum Align {
    Left,
    Center,
    Right,
}

/// A picture to be annotated.
pub(super) struct Canvas<'a> {
    image: &'a mut Image,
    font: FontRef<'static>,
    font_size: f32,
    color: [u8; 3],
}

impl<'a> Canvas<'a> {
    /// A canvas whose text is legible on a background.
    pub(super) fn new(image: &'a mut Image, background: Background) -> Self {
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).expect("a font");
        let font_size = (FONT_SIZE * image.height as f32).max(MIN_FONT_SIZE);
        let color = if background == Background::Dark { [230, 232, 236] } else { [24, 28, 34] };
        Canvas { image, font, font_size, color }
    }

    /// Draws all annotations of a view.
    pub(super) fn annotate(
        &mut self,
        view: &View,
        placement: &Placement,
        projection: &Projection,
        colors: Option<(&Attribute, Map)>,
    ) {
        if let Some(label) = &view.label {
            self.text(label, [self.margin(), self.margin()], Align::Left, 1.25);
        }
        if let Some((attribute, map)) = colors.filter(|_| view.legend) {
            match attribute.scale {
                Some(scale) => self.map_legend(&attribute.name, scale, map),
                None => self.component_legend(attribute),
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
        self.font_size
    }

    /// The map as a bar with the values at its ends and its middle, at the bottom left, with the name above.
    fn map_legend(&mut self, name: &str, scale: Scale, map: Map) {
        let length = (LEGEND_LENGTH * self.image.width as f32).round();
        let [x, bottom] = [self.margin().round(), self.image.height as f32 - 2.4 * self.font_size];
        let thickness = (0.6 * self.font_size).round();
        let y = (bottom - thickness).round();
        for column in 0..length as u32 {
            let color = map.at((column as f32 + 0.5) / length).map(to_srgb);
            self.fill([x + column as f32, y], [1.0, thickness], color);
        }
        let middle = 0.5 * scale.low + 0.5 * scale.high;
        let range = scale.high - scale.low;
        for (fraction, value, align) in [
            (0.0, scale.low, Align::Left),
            (0.5, middle, Align::Center),
            (1.0, scale.high, Align::Right),
        ] {
            let tick = (x + fraction * (length - 1.0)).round();
            self.fill([tick, y + thickness], [1.0, 0.25 * self.font_size], self.color);
            let at = [tick, y + thickness + 0.3 * self.font_size];
            self.text(&format_number(value, range), at, align, 1.0);
        }
        self.text(name, [x, y - 1.35 * self.font_size], Align::Left, 1.0);
    }

    /// The colours and numbers of the first components, at the bottom left.
    fn component_legend(&mut self, attribute: &Attribute) {
        let n_components = attribute.values.iter().copied().fold(0.0f32, f32::max) as u32 + 1;
        let side = (0.8 * self.font_size).round();
        let y = (self.image.height as f32 - 2.2 * self.font_size).round();
        let mut x = self.margin().round();
        for i in 0..n_components.min(MAX_LEGEND_COMPONENTS) {
            let color = attribute.color_of(i as f32, Map::Viridis).map(to_srgb);
            self.fill([x, y], [side, side], color);
            let at = [x + 1.3 * side, y - 0.2 * side];
            let end = self.text(&(i + 1).to_string(), at, Align::Left, 1.0);
            x = (end + side).round();
        }
        if n_components > MAX_LEGEND_COMPONENTS {
            // The colours are repeated.
            let text =
                format!("… {n_components}, from {} on again, darker", MAX_LEGEND_COMPONENTS + 1);
            self.text(&text, [x, y - 0.2 * side], Align::Left, 1.0);
        }
        let y = y - 1.5 * self.font_size;
        self.text(&attribute.name, [self.margin(), y], Align::Left, 1.0);
    }

    /// A bar of a round length at the distance of the picture's center, at the bottom right.
    fn scale_bar(&mut self, placement: &Placement, projection: &Projection) {
        let tan = (0.5 * FIELD_OF_VIEW).to_radians().tan();
        let per_pixel =
            2.0 * tan * projection.distance * placement.voxel() / f64::from(self.image.height);
        let length = round_length(MAX_BAR_LENGTH * f64::from(self.image.width) * per_pixel);
        let pixels = (length / per_pixel) as f32;
        let end = self.image.width as f32 - self.margin();
        let y = (self.image.height as f32 - self.margin() - 2.0).round();
        let tick = (0.4 * self.font_size).round();
        self.fill([end - pixels, y], [pixels, 2.0], self.color);
        for x in [end - pixels, end - 2.0] {
            self.fill([x, y - tick], [2.0, tick], self.color);
        }
        let unit = match placement.unit {
            Unit::Unknown => String::new(),
            Unit::Um => " µm".to_owned(),
            Unit::Angstrom => " Å".to_owned(),
            unit => format!(" {unit}"),
        };
        let text = format!("{}{unit}", format_number(length, length));
        let at = [end - 0.5 * pixels, y - 1.3 * self.font_size];
        self.text(&text, at, Align::Center, 1.0);
    }

    /// Draws text whose top is at `at`, in `scale` times the font size; returns the x of its right end.
    fn text(&mut self, text: &str, at: [f32; 2], align: Align, scale: f32) -> f32 {
        let size = PxScale::from(scale * self.font_size);
        let font = self.font.clone();
        let scaled = font.as_scaled(size);
        let mut glyphs: Vec<Glyph> = Vec::new();
        let mut width = 0.0;
        for c in text.chars() {
            let id = scaled.glyph_id(c);
            if let Some(previous) = glyphs.last() {
                width += scaled.kern(previous.id, id);
            }
            glyphs.push(id.with_scale_and_position(size, point(width, 0.0)));
            width += scaled.h_advance(id);
        }
        let left = match align {
            Align::Left => at[0],
            Align::Center => at[0] - 0.5 * width,
            Align::Right => at[0] - width,
        };
        // Keep the text inside of the picture.
        let left = left.min(self.image.width as f32 - width).max(0.0);
        let baseline = at[1] + scaled.ascent();
        for mut glyph in glyphs {
            glyph.position.x += left;
            glyph.position.y = baseline;
            if let Some(outline) = font.outline_glyph(glyph) {
                let low = outline.px_bounds().min;
                outline.draw(|x, y, coverage| {
                    let (x, y) = (low.x as i64 + i64::from(x), low.y as i64 + i64::from(y));
                    self.blend(x, y, self.color, coverage);
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
                self.blend(column, row, color, 1.0);
            }
        }
    }

    /// Blends a colour over a pixel.
    fn blend(&mut self, x: i64, y: i64, color: [u8; 3], coverage: f32) {
        let (width, height) = (i64::from(self.image.width), i64::from(self.image.height));
        if !(0..width).contains(&x) || !(0..height).contains(&y) || coverage <= 0.0 {
            return;
        }
        let at = 4 * (y * width + x) as usize;
        let pixel = &mut self.image.pixels[at..at + 4];
        let coverage = coverage.min(1.0);
        let below = f32::from(pixel[3]) / 255.0 * (1.0 - coverage);
        let alpha = coverage + below;
        for (byte, over) in pixel.iter_mut().zip(color) {
            let mixed = (coverage * f32::from(over) + below * f32::from(*byte)) / alpha;
            *byte = mixed.round() as u8;
        }
        pixel[3] = (255.0 * alpha).round() as u8;
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is at most `max`.
fn round_length(max: f64) -> f64 {
    let decade = 10f64.powf(max.log10().floor());
    [5.0, 2.0].into_iter().map(|n| n * decade).find(|&n| n <= max).unwrap_or(decade)
}

/// Formats a number with as many digits as distinguish values a thousandth of `range` apart.
fn format_number(x: f64, range: f64) -> String {
    let digits = (3.0 - range.abs().log10().floor()).clamp(-300.0, 300.0);
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
    fn numbers_have_as_many_digits_as_the_range_needs() {
        assert_eq!(format_number(0.5, 1.0), "0.5");
        assert_eq!(format_number(-0.0001, 1.0), "-1.00e-4");
        assert_eq!(format_number(127.5, 255.0), "127.5");
        assert_eq!(format_number(1200.0, 3000.0), "1200");
        assert_eq!(format_number(2e-9, 1e-9), "2.00e-9");
        assert_eq!(format_number(0.0, 1.0), "0");
    }

    #[test]
    fn lengths_are_round_and_not_too_long() {
        for (max, expected) in [(7.3, 5.0), (4.9, 2.0), (1.2, 1.0), (0.03, 0.02), (100.0, 100.0)] {
            assert!((round_length(max) - expected).abs() < 1e-12 * expected, "{max}");
        }
    }

    #[test]
    fn text_is_visible_and_stays_in_the_picture() {
        let blank = |alpha: u8| Image {
            width: 120,
            height: 40,
            pixels: [255, 255, 255, alpha].repeat(120 * 40),
        };
        for align in [Align::Left, Align::Center, Align::Right] {
            let mut image = blank(255);
            let mut canvas = Canvas::new(&mut image, Background::White);
            let end = canvas.text("0.25 mm", [110.0, 10.0], align, 1.0);
            assert!(end <= 120.0);
            // Strokes are about a pixel wide, so few pixels are fully covered.
            let inked = image.pixels.chunks_exact(4).filter(|p| p[0] < 200).count();
            assert!((40..800).contains(&inked), "{inked} pixels with ink");
        }
        // On a transparent background the colour is not mixed.
        let mut image = blank(0);
        Canvas::new(&mut image, Background::Transparent).fill([2.0, 2.0], [3.0, 3.0], [1, 2, 3]);
        assert_eq!(image.pixel(3, 3), [1, 2, 3, 255]);
        assert_eq!(image.pixel(9, 9)[3], 0);
    }
}
