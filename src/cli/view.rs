//! `view`: a window.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use isospectrum::Parameters;
use isospectrum::render::{Background, reveal_inner};
use isospectrum::spectrum::{Keep, Spectrum};
use isospectrum::view::{Content, MAX_TRIANGLES, Opening, run};
use isospectrum::volume::{Placement, ReadOptions, Statistics, Volume, phantom, read_volume};
use isospectrum::{Error, Result};

use super::border_arguments::BorderArguments;
use super::camera_arguments::CameraArguments;
use super::color_arguments::ColorArguments;
use super::cutaway_arguments::CutawayArguments;
use super::heading;
use super::keep_arguments::KeepArguments;
use super::mark_argument::{Mark, resolved};
use super::number_argument::positive;
use super::size_argument::PictureSize;
use super::spectrum_file::{Format, Opened};
use super::style_arguments::StyleArguments;
use super::surface_argument::SurfaceArgument;

const EXAMPLES: &str = "\
Examples:
  isospectrum view scan.isp -c 1200
  isospectrum view scan.nrrd --error 0.2
  isospectrum view --phantom hydrogen:64";

/// Open a window on a spectrum or a volume
///
/// The window computes the spectrum of a volume. Other files can be dropped on it.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = EXAMPLES)]
pub(super) struct View {
    /// Spectrum (.isp) or volume
    file: Option<PathBuf>,
    /// Use a built-in volume, e.g. hydrogen:64
    #[arg(long, value_name = "NAME[:SIZE]", conflicts_with = "file")]
    phantom: Option<String>,
    /// Volume of the spectrum, for its histogram
    #[arg(long, value_name = "FILE", requires = "file")]
    volume: Option<PathBuf>,
    /// First isovalue: 120, 50%, p99, top:1%, ...
    ///
    /// The default is 50%, or the nearest with a visible surface. Give the flag again for more surfaces that stay visible,
    /// with colour and opacity: 1200=bone@0.5.
    #[arg(short = 'c', long, value_name = "C", allow_hyphen_values = true)]
    isovalue: Vec<SurfaceArgument>,
    /// Offer isovalues by name, e.g. 120=bone,40=skin [default: suggestions]
    #[arg(
        long,
        value_name = "C[=NAME],...",
        value_delimiter = ',',
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    mark: Vec<Mark>,
    #[command(flatten)]
    cutaway: CutawayArguments,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    keep: KeepArguments,
    #[command(flatten)]
    color: ColorArguments,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    style: StyleArguments,
    /// Draw the edges of the triangles
    #[arg(long, help_heading = heading::PICTURE)]
    wireframe: bool,
    /// Draw the box of the volume, axes and a scale bar
    #[arg(long, help_heading = heading::PICTURE)]
    axes: bool,
    /// Background: white, light or dark
    #[arg(long, value_name = "COLOR", help_heading = heading::PICTURE)]
    background: Option<Background>,
    /// Tolerance of computed spectra, voxels
    #[arg(long, value_name = "H", value_parser = positive, default_value_t = Parameters::default().error, hide_short_help = true, help_heading = heading::TRACKING)]
    error: f64,
    /// Distance between sampling isovalues of computed spectra
    #[arg(long, value_name = "STEP", value_parser = positive, hide_short_help = true, help_heading = heading::TRACKING)]
    step: Option<f64>,
    /// Width and height, points
    #[arg(long, value_name = "WxH", default_value = "1280x800", help_heading = heading::WINDOW)]
    size: PictureSize,
    /// Folder for pictures and meshes
    #[arg(long, value_name = "FOLDER", default_value = ".", help_heading = heading::OUTPUT)]
    folder: PathBuf,
    /// Read spectra of more triangles in parts
    #[arg(long, value_name = "N", default_value_t = MAX_TRIANGLES, hide_short_help = true, help_heading = heading::MACHINE)]
    max_triangles: u64,
    /// File for the names and places of the window's controls, for tests
    #[arg(long, value_name = "FILE", hide = true)]
    controls: Option<PathBuf>,
    /// GPU to use, by a part of its name
    #[arg(long, value_name = "NAME", hide_short_help = true, help_heading = heading::MACHINE)]
    adapter: Option<String>,
}

impl View {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let volume = self.volume.as_deref().map(read).transpose()?;
        let content = self.content()?;
        if self.background == Some(Background::Transparent) {
            let message = "background 'transparent', expected white, light or dark";
            return Err(Error::Usage(message.into()).into());
        }
        let header = header(&content);
        let (surfaces, marks) = match header {
            Some(spectrum) => {
                let own = volume.as_ref().map(Statistics::of);
                let samples = own.or_else(|| spectrum.statistics());
                let resolve = |c: &SurfaceArgument| c.resolve(spectrum.range(), samples.as_ref());
                let mut surfaces = self.isovalue.iter().map(resolve).collect::<Result<Vec<_>>>()?;
                if self.cutaway.opacity == 1.0 {
                    reveal_inner(&mut surfaces);
                }
                (surfaces, resolved(&self.mark, spectrum, samples.as_ref())?)
            }
            None => Default::default(),
        };
        let clip = self.cutaway.clip.map(|clip| match (&content, header) {
            (Content::Volume(volume) | Content::Phantom(volume), _) => {
                clip.of_grid(volume.dims(), volume.placement())
            }
            (_, Some(spectrum)) => clip.of(spectrum.volume()),
            (_, None) => clip.of_grid([2; 3], &Placement::default()),
        });
        let opacity = surfaces.first().and_then(|first| first.opacity);
        let open = header.map_or(self.border.open(), |spectrum| self.border.is_open(spectrum));
        let keep = header.map_or(Keep::default(), |spectrum| self.keep.of(spectrum));
        let look = self.style.view();
        let background = self.background.unwrap_or(look.background);
        run(Opening {
            content,
            volume,
            field: self.color.color_by.as_deref().map(read).transpose()?,
            surfaces,
            marks,
            view: look
                .with_width(self.size.width)
                .with_height(self.size.height)
                .with_camera(self.camera.camera())
                .with_wireframe(self.wireframe.then_some(1.0))
                .with_axes(self.axes)
                .with_scale_bar(self.axes)
                .with_color(self.color.shown())
                .with_map(self.color.color_map)
                .with_ends(self.color.ends())
                .with_open(open)
                .with_keep(keep)
                .with_background(background)
                .with_clip(clip)
                .with_opacity(opacity.unwrap_or(self.cutaway.opacity as f32)),
            parameters: Parameters::default().with_error(self.error).with_step(self.step),
            max_triangles: self.max_triangles,
            adapter: self.adapter.clone(),
            folder: self.folder.clone(),
            controls: self.controls.clone(),
        })?;
        Ok(())
    }

    /// Opens the file or the built-in volume.
    fn content(&self) -> Result<Content> {
        let Some(path) = &self.file else {
            let volume = self.phantom.as_deref().map(phantom).transpose()?;
            return Ok(volume.map_or(Content::Nothing, |volume| Content::Phantom(volume.into())));
        };
        if Format::of_name(path).is_err() {
            return Ok(Content::Volume(read(path)?.into()));
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(match Opened::open(path)? {
            Opened::Whole(spectrum, _) => Content::Spectrum(name, spectrum),
            Opened::File(file) if file.size().triangles > self.max_triangles => {
                Content::File(name, Arc::from(file))
            }
            // Read before there is a window, so that a damaged file is an error of one line.
            Opened::File(file) => Content::Spectrum(name, file.read()?.into()),
        })
    }
}

/// Returns the spectrum, of a file without triangles, if there is one.
fn header(content: &Content) -> Option<&Spectrum> {
    match content {
        Content::Spectrum(_, spectrum) => Some(spectrum),
        Content::File(_, file) => Some(file.description()),
        Content::Nothing | Content::Volume(_) | Content::Phantom(_) => None,
    }
}

fn read(path: &Path) -> Result<Volume> {
    read_volume(path, &ReadOptions::default())
}
