//! Pictures and PNG files.

use std::io::Write;
use std::path::Path;

use crate::atomic_file::write_atomically;
use crate::error::Result;

/// A picture: sRGB with straight alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, alpha of every pixel, rows from the top, each from the left.
    pub pixels: Vec<u8>,
}

impl Image {
    /// Red, green, blue, alpha of the pixel in column `x` and row `y` from the top left.
    ///
    /// # Panics
    ///
    /// If the pixel is outside of the picture.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) is outside of the picture");
        let at = 4 * (y as usize * self.width as usize + x as usize);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2], self.pixels[at + 3]]
    }

    /// Encodes the picture as PNG, 8 bit RGBA, marked as sRGB.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn encode_png(&self, to: impl Write) -> std::io::Result<()> {
        let mut encoder = png::Encoder::new(to, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(())
    }

    /// Writes the picture as a PNG file. The file is complete under its name, or not written at all.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Io`] if the file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<()> {
        write_atomically(path, |writer| self.encode_png(writer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_picture_reads_back_equal_and_leaves_no_other_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("picture.png");
        let image =
            Image { width: 3, height: 2, pixels: (0..24).map(|i| (i * 10) as u8).collect() };
        image.write_png(&path).expect("a file");
        let file = std::io::BufReader::new(std::fs::File::open(&path).expect("the file"));
        let mut reader = png::Decoder::new(file).read_info().expect("a picture");
        let mut pixels = vec![0; image.pixels.len()];
        let info = reader.next_frame(&mut pixels).expect("a frame");
        assert_eq!((info.width, info.height, &pixels), (3, 2, &image.pixels));
        assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 1);
    }

    #[test]
    fn a_folder_that_does_not_exist_is_an_error_that_names_the_file() {
        let image = Image { width: 1, height: 1, pixels: vec![0; 4] };
        let error = image.write_png(Path::new("no/such/folder/p.png")).expect_err("no folder");
        assert!(error.to_string().starts_with("no/such/folder/p.png: "), "{error}");
    }
}
