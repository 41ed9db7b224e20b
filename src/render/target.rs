//! What a picture is drawn into, and how it comes back.

use std::sync::mpsc;
use std::time::Duration;

use super::image::Image;
use crate::color::{to_linear, to_srgb};
use crate::error::{Error, Result};

/// Colours are stored in sRGB; the device converts, and averages samples in linear light.
pub(super) const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// The bytes of the colours without conversion.
pub(crate) const SHOWN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Depth, and a stencil, which counts where a plane is inside of a surface.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;

/// How long a picture may take before the device counts as hung.
const PATIENCE: Duration = Duration::from_secs(300);

/// The textures of one size of picture, and the buffer through which it is read.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Every sample of every pixel.
    pub(super) samples: wgpu::TextureView,
    /// The average of each pixel's samples; none where there is one sample per pixel.
    pub(super) resolved: Option<wgpu::TextureView>,
    pub(super) depth: wgpu::TextureView,
    /// The depth without the stencil, to be read.
    pub(super) depth_alone: wgpu::TextureView,
    /// The texture that holds the picture in the end.
    picture: wgpu::Texture,
    staging: wgpu::Buffer,
    bytes_per_row: u32,
}

impl Target {
    /// Textures for pictures of `width` by `height` pixels with `n_samples` samples each.
    pub(super) fn new(device: &wgpu::Device, width: u32, height: u32, n_samples: u32) -> Self {
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
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        // A window shows the bytes as they are: it takes the texture for linear.
        let picture = texture(
            "surface.picture",
            COLOR_FORMAT,
            1,
            drawn | wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::TEXTURE_BINDING,
            &[SHOWN_FORMAT],
        );
        let (samples, resolved) = if n_samples > 1 {
            let samples = texture("surface.samples", COLOR_FORMAT, n_samples, drawn, &[]);
            (view(&samples), Some(view(&picture)))
        } else {
            (view(&picture), None)
        };
        let read = drawn | wgpu::TextureUsages::TEXTURE_BINDING;
        let depths = texture("surface.depth", DEPTH_FORMAT, n_samples, read, &[]);
        let depth_alone = depths.create_view(&wgpu::TextureViewDescriptor {
            aspect: wgpu::TextureAspect::DepthOnly,
            ..Default::default()
        });
        let bytes_per_row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
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
            depth: view(&depths),
            depth_alone,
            picture,
            staging,
            bytes_per_row,
        }
    }

    /// The texture that holds the picture.
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

    /// Waits for the copy and takes the picture.
    pub(super) fn read(&self, device: &wgpu::Device) -> Result<Image> {
        let failed = |what: String| Error::Gpu(format!("the picture cannot be read back: {what}"));
        let (sender, receiver) = mpsc::channel();
        self.staging.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver waits below; it is gone only if the wait failed, which is reported.
            let _ = sender.send(result);
        });
        device
            .poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) })
            .map_err(|error| failed(error.to_string()))?;
        // Another thread's wait on this device may be the one that delivers the answer.
        receiver
            .recv_timeout(PATIENCE)
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

/// Divides the colours by alpha, in linear light: the average over a pixel's samples counts the
/// empty ones as black, but a picture file holds the colour of what is there.
pub(super) fn unmultiply(image: &mut Image) {
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
        unmultiply(&mut image);
        // 188 stands for 0.5 to within 0.005; white is reached within two steps.
        assert!(image.pixels[..3].iter().all(|&c| c >= 253), "{:?}", image.pixels);
        assert_eq!(image.pixels[3..], [128, 9, 9, 9, 0]);
    }
}
