//! `view`: the window.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Parameters;
use isospectrum::file::{SpectrumFolder, is_folder};
use isospectrum::render::{Background, Light, View as Look};
use isospectrum::spectrum::{Keep, Spectrum};
use isospectrum::view::{Content, Opening, run};
use isospectrum::volume::{Placement, ReadOptions, Statistics, phantom, read_volume};

use super::border_arguments::BorderArguments;
use super::camera_arguments::CameraArguments;
use super::color_arguments::ColorArguments;
use super::compute::positive;
use super::keep_arguments::KeepArguments;
use super::mark_argument::{Mark, resolved};
use super::render::Size;
use super::sight_arguments::SightArguments;
use super::spectrum_file::{self, Format};
use super::surface_argument::SurfaceArgument;

/// Open a window on a spectrum, or on a volume whose spectrum it computes
#[derive(Args, Debug)]
pub(super) struct View {
    /// Spectrum (.isp, or a folder .ispt) or volume (.nrrd, .npy, .raw); others can be dropped on the window
    file: Option<PathBuf>,
    /// A built-in volume in place of a file, e.g. hydrogen:64
    #[arg(long, value_name = "NAME[:SIZE]", conflicts_with = "file")]
    phantom: Option<String>,
    /// The spectrum's volume: shows the histogram of its samples, and p99 can be typed
    #[arg(long, value_name = "FILE", requires = "file")]
    volume: Option<PathBuf>,
    /// First isovalue of a spectrum; else 50%, or the nearest with more than a trace to see. Given again, others stay beside it; each
    /// may have a colour and an opacity, such as 1200=bone@0.5
    #[arg(short = 'c', long, value_name = "C[=COLOR][@OPACITY]", allow_hyphen_values = true)]
    isovalue: Vec<SurfaceArgument>,
    /// Isovalues of a spectrum that are offered, each with a name; without any some are suggested
    #[arg(long, value_name = "C[=NAME],...", value_delimiter = ',', allow_hyphen_values = true)]
    mark: Vec<Mark>,
    /// Width and height of the window, points
    #[arg(long, value_name = "WxH", default_value = "1280x800")]
    size: Size,
    #[command(flatten)]
    camera: CameraArguments,
    /// Draw the edges of the triangles
    #[arg(long)]
    wireframe: bool,
    /// Darken hollows, by what is seen around each point: shows form where noise hides it
    #[arg(long)]
    occlusion: bool,
    /// Where the main light is, as seen by who looks: upper-left, eye (no shadow), left, right, above or below
    #[arg(long, value_name = "WHERE", default_value = "upper-left")]
    light: Light,
    /// Draw the box of the volume, the axes of the world and a scale bar
    #[arg(long)]
    axes: bool,
    #[command(flatten)]
    color: ColorArguments,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    keep: KeepArguments,
    /// What lies behind the surface: white, light or dark
    #[arg(long, value_name = "WHAT", default_value = "white")]
    background: Background,
    #[command(flatten)]
    sight: SightArguments,
    /// Tolerance of spectra that are computed, voxels
    #[arg(long, value_name = "H", value_parser = positive, allow_negative_numbers = true)]
    error: Option<f64>,
    /// Distance between sampling isovalues of spectra that are computed
    #[arg(long, value_name = "STEP", value_parser = positive, allow_negative_numbers = true)]
    step: Option<f64>,
    /// Folder for pictures and meshes
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,
    /// Adapter to use, by a part of its name
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

impl View {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let defaults = Parameters::default();
        let volume = self.volume.as_deref().map(read).transpose()?;
        let content = self.content()?;
        if self.background == Background::Transparent {
            let told = "background 'transparent', expected white, light or dark";
            return Err(isospectrum::Error::Usage(told.into()).into());
        }
        let told = told(&content);
        let (surfaces, marks) = match told {
            Some(spectrum) => {
                let own = volume.as_ref().map(Statistics::of);
                let samples = own.or_else(|| spectrum.statistics());
                let resolve = |c: &SurfaceArgument| c.resolve(spectrum.range(), samples.as_ref());
                let surfaces = self.isovalue.iter().map(resolve).collect::<Result<Vec<_>, _>>()?;
                (surfaces, resolved(&self.mark, spectrum, samples.as_ref())?)
            }
            None => Default::default(),
        };
        let clip = self.sight.clip.map(|clip| match (&content, told) {
            (Content::Volume(volume), _) => clip.of_grid(volume.dims(), volume.placement()),
            (_, Some(spectrum)) => clip.of(spectrum.volume()),
            (_, None) => clip.of_grid([2; 3], &Placement::default()),
        });
        let opacity = surfaces.first().and_then(|first| first.opacity);
        let open = told.map_or(self.border.open(), |spectrum| self.border.is_open(spectrum));
        let keep = told.map_or(Keep::default(), |spectrum| self.keep.of(spectrum));
        run(Opening {
            content,
            volume,
            field: self.color.color_by.as_deref().map(read).transpose()?,
            surfaces,
            marks,
            view: Look {
                width: self.size.width,
                height: self.size.height,
                camera: self.camera.camera(),
                wireframe: self.wireframe.then_some(1.0),
                occlusion: self.occlusion,
                light: self.light,
                axes: self.axes,
                scale_bar: self.axes,
                color: self.color.shown(),
                map: self.color.color_map,
                ends: self.color.ends(),
                open,
                keep,
                background: self.background,
                clip,
                opacity: opacity.unwrap_or(self.sight.opacity as f32),
                ..Look::default()
            },
            parameters: defaults
                .with_error(self.error.unwrap_or(defaults.error))
                .with_step(self.step),
            adapter: self.adapter.clone(),
            folder: self.folder.clone(),
        })?;
        Ok(())
    }

    fn content(&self) -> isospectrum::Result<Content> {
        let Some(path) = &self.file else {
            let volume = self.phantom.as_deref().map(phantom).transpose()?;
            return Ok(volume.map_or(Content::Nothing, |volume| Content::Volume(volume.into())));
        };
        if !is_folder(path) && Format::of_name(path).is_err() {
            return Ok(Content::Volume(read(path)?.into()));
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if is_folder(path) {
            return Ok(Content::Folder(name, SpectrumFolder::open(path)?.into()));
        }
        let (spectrum, _) = spectrum_file::read(path)?;
        Ok(Content::Spectrum(name, spectrum.into()))
    }
}

/// All that is known of the whole of the spectrum, if there is one.
fn told(content: &Content) -> Option<&Spectrum> {
    match content {
        Content::Spectrum(_, spectrum) => Some(spectrum),
        Content::Folder(_, folder) => Some(folder.whole()),
        Content::Nothing | Content::Volume(_) => None,
    }
}

fn read(path: &Path) -> isospectrum::Result<isospectrum::volume::Volume> {
    read_volume(path, &ReadOptions::default())
}
