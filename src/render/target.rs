//! Render targets, and reading them back.

use std::sync::mpsc;
use std::time::Duration;

use super::image::Image;
use crate::color::{to_linear, to_srgb};
use crate::error::{Error, Result};

/// Colours are stored in sRGB; the device converts them, and averages samples in linear light.
pub(super) const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// The view format of the window, which shows the bytes without conversion.
pub(crate) const WINDOW_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Depth, and a stencil to find where the clip plane is inside of a surface.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;

/// Longest time for a picture; after it the device counts as hung.
const TIMEOUT: Duration = Duration::from_secs(300);

/// Pictures of more pixels may be beyond the memory of a GPU.
const LARGE_PICTURE: u64 = 1 << 24;

/// Bytes of a row of pixels in a buffer.
fn bytes_per_row(width: u32) -> u32 {
    (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

/// The textures for one size of pictures, and the staging buffer to read them back.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Every sample of every pixel.
    pub(super) samples: wgpu::TextureView,
    /// The average of each pixel's samples; `None` for one sample per pixel.
    pub(super) resolved: Option<wgpu::TextureView>,
    pub(super) depth: wgpu::TextureView,
    /// The depth without the stencil, for shaders.
    pub(super) depth_only: wgpu::TextureView,
    /// The texture of the finished picture.
    picture: wgpu::Texture,
    staging: wgpu::Buffer,
    bytes_per_row: u32,
}

impl Target {
    /// The error of textures that a GPU did not make, if their size explains it.
    pub(super) fn too_large((width, height): (u32, u32), n_samples: u32) -> Option<Error> {
        let pixels = u64::from(width) * u64::from(height);
        // Colour and depth of each sample, the picture, and the buffer to read it back.
        let megabytes = pixels * (8 * u64::from(n_samples) + 8) / 1_000_000;
        (pixels > LARGE_PICTURE).then(|| {
            Error::Usage(format!(
                "picture of {width}x{height} pixels takes {megabytes} MB on the GPU, which cannot hold it, expected fewer pixels"
            ))
        })
    }

    /// Textures for pictures of a width and height, with `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, size: (u32, u32), n_samples: u32) -> Self {
        let (width, height) = size;
        let texture = |label, format, sample_count, usage, view_formats| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats,
            })
        };
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let readable = attachment | wgpu::TextureUsages::TEXTURE_BINDING;
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let picture = texture(
            "surface.picture",
            COLOR_FORMAT,
            1,
            readable | wgpu::TextureUsages::COPY_SRC,
            &[WINDOW_FORMAT],
        );
        let (samples, resolved) = if n_samples > 1 {
            let samples = texture("surface.samples", COLOR_FORMAT, n_samples, attachment, &[]);
            (view(&samples), Some(view(&picture)))
        } else {
            (view(&picture), None)
        };
        let depth = texture("surface.depth", DEPTH_FORMAT, n_samples, readable, &[]);
        let depth_only = depth.create_view(&wgpu::TextureViewDescriptor {
            aspect: wgpu::TextureAspect::DepthOnly,
            ..Default::default()
        });
        let bytes_per_row = bytes_per_row(width);
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("surface.staging"),
            size: u64::from(bytes_per_row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Target {
            width,
            height,
            samples,
            resolved,
            depth: view(&depth),
            depth_only,
            picture,
            staging,
            bytes_per_row,
        }
    }

    /// Checks that a picture of a size can be read back from a device with buffers of at most `max_bytes`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if it cannot.
    pub(super) fn check((width, height): (u32, u32), max_bytes: u64) -> Result<()> {
        let bytes = u64::from(bytes_per_row(width)) * u64::from(height);
        if bytes > max_bytes {
            return Err(Error::Usage(format!(
                "picture of {width}x{height} pixels takes {bytes} bytes, expected at most {max_bytes} on this GPU"
            )));
        }
        Ok(())
    }

    /// The texture of the finished picture.
    #[cfg(feature = "viewer")]
    pub(super) fn texture(&self) -> &wgpu::Texture {
        &self.picture
    }

    /// Records the copy of the finished picture into the staging buffer.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.bytes_per_row),
                    rows_per_image: None,
                },
            },
            self.picture.size(),
        );
    }

    /// Waits for the copy and returns the picture.
    pub(super) fn read(&self, device: &wgpu::Device) -> Result<Image> {
        let failed = |what: String| Error::Gpu(format!("the picture cannot be read back: {what}"));
        let (sender, receiver) = mpsc::channel();
        self.staging.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is dropped only if the wait below fails, which is reported.
            let _ = sender.send(result);
        });
        device
            .poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(TIMEOUT) })
            .map_err(|error| failed(error.to_string()))?;
        // The callback may run in another thread that polls this device.
        receiver
            .recv_timeout(TIMEOUT)
            .map_err(|_| failed("the device did not answer".into()))?
            .map_err(|error| failed(error.to_string()))?;
        let row = 4 * self.width as usize;
        let mut pixels = Vec::with_capacity(row * self.height as usize);
        let rows = self.staging.get_mapped_range(..).map_err(|error| failed(error.to_string()))?;
        for padded in rows.chunks_exact(self.bytes_per_row as usize) {
            pixels.extend_from_slice(&padded[..row]);
        }
        drop(rows);
        self.staging.unmap();
        Ok(Image { width: self.width, height: self.height, pixels })
    }
}

/// Divides the colours by alpha, in linear light: the average over a pixel's samples counts empty samples as black, but picture
/// files have straight alpha.
pub(super) fn unpremultiply(image: &mut Image) {
    for pixel in image.pixels.chunks_exact_mut(4) {
        let alpha = pixel[3];
        if alpha == 0 || alpha == 255 {
            continue;
        }
        for channel in &mut pixel[..3] {
            *channel = to_srgb(to_linear(*channel) * 255.0 / f32::from(alpha));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_covered_white_stays_white() {
        // Half of white in linear light is 188 in sRGB.
        let mut image = Image { width: 2, height: 1, pixels: vec![188, 188, 188, 128, 9, 9, 9, 0] };
        unpremultiply(&mut image);
        // 188 stands for 0.5 to within 0.005; white is reached within two steps.
        assert!(image.pixels[..3].iter().all(|&c| c >= 253), "{:?}", image.pixels);
        assert_eq!(image.pixels[3..], [128, 9, 9, 9, 0]);
    }
}
