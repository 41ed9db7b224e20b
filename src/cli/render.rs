//! `render`: a picture of the mesh at one isovalue, or many along a sweep, without a window.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use isospectrum::render::{Background, Renderer, Surface, View, reveal_inner};
use isospectrum::series::{Frames, MAX_FRAMES, Series};
use isospectrum::spectrum::Spectrum;
use isospectrum::{Error, Result};

use super::border_arguments::BorderArguments;
use super::camera_arguments::CameraArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::cutaway_arguments::CutawayArguments;
use super::interrupt::Signals;
use super::keep_arguments::KeepArguments;
use super::progress::Bar;
use super::size_argument::PictureSize;
use super::spectrum_file::Opened;
use super::style_arguments::StyleArguments;
use super::surface_argument::SurfaceArgument;
use super::sweep_argument::SweepArgument;
use super::{empty, gpu, heading, report};
use isospectrum::file::Output;

const EXAMPLES: &str = "\
Examples:
  isospectrum render scan.isp -c 50% -o half.png
  Show bone through skin, seen from the left:
    isospectrum render head.isp -c 1200=bone -c -200=skin@0.3 --camera -90,10 -o head.png
  Make a film over the isovalues, and one around the surface:
    isospectrum render scan.isp --sweep 10%:90%:120 --label {isovalue} -o sweep.mp4
    isospectrum render scan.isp -c 50% --turntable 90 -o around/%03d.png";

/// Render the mesh at one isovalue to a picture, or many to a film
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = EXAMPLES)]
pub(super) struct Render {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: 120, 50%, p99, 2.5sigma or top:1%
    ///
    /// A number, a percentage of the range (50%), a percentile of the samples (p99), standard deviations above their mean
    /// (2.5sigma), or the value that the highest 1 % of them exceed (top:1%). A colour (a name or
    /// #rrggbb) and an opacity can follow. Give the flag again for several surfaces: -c 120=bone -c 40=skin@0.3.
    #[arg(
        short = 'c',
        long,
        value_name = "C",
        allow_hyphen_values = true,
        required_unless_present = "sweep"
    )]
    isovalue: Vec<SurfaceArgument>,
    /// N pictures at isovalues A to B, e.g. 10%:90%:120
    ///
    /// -o takes a pattern such as frames/%04d.png, numbered from 0, or a film (.mp4, .webm), which needs ffmpeg.
    #[arg(long, value_name = "A:B:N", allow_hyphen_values = true, conflicts_with = "isovalue")]
    sweep: Option<SweepArgument>,
    /// Volume of the spectrum, for --color distance
    #[arg(long, value_name = "VOLUME", hide_short_help = true)]
    volume: Option<PathBuf>,
    #[command(flatten)]
    cutaway: CutawayArguments,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    keep: KeepArguments,
    #[command(flatten)]
    color: ColorArguments,
    /// Leave out the legend of the colours
    #[arg(long, hide_short_help = true, help_heading = heading::COLORS)]
    no_legend: bool,
    #[command(flatten)]
    camera: CameraArguments,
    /// N pictures from all around the vertical axis
    ///
    /// All have the same scale. -o is as for --sweep.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=i64::from(MAX_FRAMES)), conflicts_with = "sweep", help_heading = heading::CAMERA)]
    turntable: Option<u32>,
    /// Fit to the surface or the volume
    ///
    /// With `surface`, that of all pictures of a sweep. With `volume`, pictures of different isovalues have the same scale.
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = Fit::Surface, hide_possible_values = true, hide_short_help = true, help_heading = heading::CAMERA)]
    fit: Fit,
    #[command(flatten)]
    style: StyleArguments,
    /// Draw the edges of the triangles
    #[arg(long, help_heading = heading::PICTURE)]
    wireframe: bool,
    /// Draw the box of the volume, axes and a scale bar
    #[arg(long, help_heading = heading::PICTURE)]
    axes: bool,
    /// Draw a scale bar in the unit of the volume
    #[arg(long, hide_short_help = true, help_heading = heading::PICTURE)]
    scale_bar: bool,
    /// Text at the top, e.g. "c = {isovalue}"
    ///
    /// {isovalue} is replaced by the isovalue.
    #[arg(long, value_name = "TEXT", help_heading = heading::PICTURE)]
    label: Option<String>,
    /// Background: white, light, dark or transparent
    #[arg(long, value_name = "COLOR", help_heading = heading::PICTURE)]
    background: Option<Background>,
    /// Width and height, pixels
    #[arg(long, value_name = "WxH", default_value = "1024x768", help_heading = heading::OUTPUT)]
    size: PictureSize,
    /// Pictures per second of a film [default: 30]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240), help_heading = heading::OUTPUT)]
    fps: Option<u32>,
    /// Picture to write (.png), or - for stdout
    ///
    /// For several pictures a pattern such as frames/%04d.png, or a film (.mp4, .webm).
    #[arg(short, long, value_name = "FILE", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// GPU to use, by a part of its name
    #[arg(long, value_name = "NAME", hide_short_help = true, help_heading = heading::MACHINE)]
    adapter: Option<String>,
}

impl Render {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        match (self.sweep, self.turntable) {
            (Some(sweep), _) => self.run_sweep(sweep, quiet),
            (None, Some(n)) => self.run_turntable(n, quiet),
            (None, None) => self.run_one(),
        }
    }

    fn run_one(&self) -> anyhow::Result<()> {
        if self.fps.is_some() {
            return Err(Error::Usage("--fps needs --sweep or --turntable".into()).into());
        }
        let is_png = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        if !is_png && self.output != Path::new("-") {
            let shown = self.output.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .png")).into());
        }
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let output = Output::open(&self.output, &inputs)?;
        let spectrum = Opened::open(&self.spectrum)?;
        let isovalues = self.isovalues(spectrum.header())?;
        let spectrum = spectrum.around(&isovalues)?;
        let (surfaces, isovalues) = self.surfaces(&spectrum)?;
        let mut pictures = self.pictures(&spectrum)?;
        let mut view = self.fit.of(self.view(&spectrum), &mut pictures, &isovalues)?;
        view.label = self.label(&isovalues);
        pictures.write(&surfaces, &view, output)?;
        empty::warn_of_components(pictures.0.n_triangles(), &view.keep);
        let PictureSize { width, height } = self.size;
        let shown: Vec<String> = isovalues.into_iter().map(report::number).collect();
        let shown = shown.join(", ");
        log::info!("{}: {width}x{height} pixels, isovalue {shown}", self.output.display());
        Ok(())
    }

    /// Renders every picture of a sweep.
    fn run_sweep(&self, sweep: SweepArgument, quiet: bool) -> anyhow::Result<()> {
        let series = self.series()?;
        let spectrum = Opened::open(&self.spectrum)?;
        let isovalues = sweep.in_spectrum(spectrum.header())?;
        let spectrum = spectrum.around(&isovalues)?;
        let mut pictures = self.pictures(&spectrum)?;
        let (view, label) = (self.view(&spectrum), |c| self.label(&[c]));
        let is_fitted = self.fit == Fit::Surface;
        let frames = Frames::sweep(&mut pictures.0, view, &isovalues, is_fitted, &label)?;
        self.write_series(&mut pictures, &frames, isovalues.len() as u32, &series, quiet)?;
        let is_empty = |&&c: &&f64| empty::is_empty(&spectrum, c, self.border.is_open(&spectrum));
        let n_empty = isovalues.iter().filter(is_empty).count();
        if n_empty > 0 {
            log::warn!("{n_empty} of {} pictures show no surface", isovalues.len());
        }
        Ok(())
    }

    /// Renders the pictures of a turntable.
    fn run_turntable(&self, n: u32, quiet: bool) -> anyhow::Result<()> {
        let series = self.series()?;
        let spectrum = Opened::open(&self.spectrum)?;
        let isovalues = self.isovalues(spectrum.header())?;
        let spectrum = spectrum.around(&isovalues)?;
        let (surfaces, isovalues) = self.surfaces(&spectrum)?;
        let mut pictures = self.pictures(&spectrum)?;
        let view = self.view(&spectrum).with_label(self.label(&isovalues));
        let is_fitted = self.fit == Fit::Surface;
        let frames = Frames::turntable(&mut pictures.0, &view, &surfaces, is_fitted, n)?;
        self.write_series(&mut pictures, &frames, n, &series, quiet)?;
        empty::warn_of_components(pictures.0.n_triangles(), &view.keep);
        Ok(())
    }

    /// Renders a series of pictures. Each file appears when it is complete.
    fn write_series(
        &self,
        pictures: &mut Pictures<'_>,
        frames: &Frames,
        n: u32,
        series: &Series,
        quiet: bool,
    ) -> anyhow::Result<()> {
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let bar = Bar::new(quiet);
        frames.write(&mut pictures.0, series, &inputs, &bar)?;
        drop(bar);
        let PictureSize { width, height } = self.size;
        log::info!("{}: {n} pictures of {width}x{height} pixels", series.names(n));
        Ok(())
    }

    /// Returns the destination of a series of pictures.
    fn series(&self) -> Result<Series> {
        let PictureSize { width, height } = self.size;
        Series::of(&self.output, self.fps, [width, height], self.background())
    }

    /// Returns the requested isovalues; checks that they are in the range.
    fn isovalues(&self, spectrum: &Spectrum) -> Result<Vec<f64>> {
        let isovalue = |c: &SurfaceArgument| {
            let isovalue = c.in_spectrum(spectrum)?.isovalue;
            spectrum.check_isovalue(isovalue).map(|()| isovalue)
        };
        self.isovalue.iter().map(isovalue).collect()
    }

    /// Returns the requested isosurfaces and their isovalues; warns about empty ones.
    fn surfaces(&self, spectrum: &Spectrum) -> Result<(Vec<Surface>, Vec<f64>)> {
        let mut surfaces: Vec<Surface> =
            self.isovalue.iter().map(|c| c.in_spectrum(spectrum)).collect::<Result<_>>()?;
        if self.cutaway.opacity == 1.0 {
            reveal_inner(&mut surfaces);
        }
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        for &isovalue in &isovalues {
            spectrum.check_isovalue(isovalue)?;
            empty::warn(spectrum, isovalue, self.border.is_open(spectrum));
        }
        Ok((surfaces, isovalues))
    }

    /// Returns the text at the top of a picture.
    fn label(&self, isovalues: &[f64]) -> Option<String> {
        let shown: Vec<String> = isovalues.iter().map(|&c| report::number(c)).collect();
        self.label.as_ref().map(|label| label.replace("{isovalue}", &shown.join(", ")))
    }

    /// Opens the renderer of a spectrum with the sources of its colours.
    fn pictures<'a>(&self, spectrum: &'a Spectrum) -> Result<Pictures<'a>> {
        let volume = self.volume.as_ref().map(|path| volume_of(path, spectrum)).transpose()?;
        let sources = self.color.sources(spectrum, volume)?;
        let mut pictures = Pictures::open(spectrum, self.adapter.as_deref())?;
        pictures.0.set_sources(sources);
        Ok(pictures)
    }

    /// Returns the background: the one given, else that of the style.
    fn background(&self) -> Background {
        self.background.or(self.style.style.values().background).unwrap_or_default()
    }

    fn view(&self, spectrum: &Spectrum) -> View {
        let PictureSize { width, height } = self.size;
        self.style
            .view()
            .with_width(width)
            .with_height(height)
            .with_camera(self.camera.camera())
            .with_wireframe(self.wireframe.then_some(1.0))
            .with_color(self.color.shown())
            .with_map(self.color.color_map)
            .with_ends(self.color.ends())
            .with_clip(self.cutaway.clip.map(|clip| clip.of(spectrum.volume())))
            .with_legend(!self.no_legend)
            .with_axes(self.axes)
            .with_scale_bar(self.scale_bar || self.axes)
            .with_open(self.border.is_open(spectrum))
            .with_keep(self.keep.of(spectrum))
            .with_background(self.background())
            .with_opacity(self.cutaway.opacity as f32)
    }
}

/// What the picture is fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Fit {
    /// The visible isosurfaces.
    Surface,
    /// The whole volume.
    Volume,
}

impl Fit {
    /// Returns the view for pictures of `isovalues`.
    fn of(self, view: View, pictures: &mut Pictures<'_>, isovalues: &[f64]) -> Result<View> {
        match self {
            Fit::Surface => pictures.fitted(view, isovalues),
            Fit::Volume => Ok(view),
        }
    }
}

/// Renders pictures of one spectrum on one adapter.
pub(super) struct Pictures<'a>(Renderer<'a>);

impl<'a> Pictures<'a> {
    /// Opens the adapter whose name contains `adapter`, or the fastest.
    pub(super) fn open(spectrum: &'a Spectrum, adapter: Option<&str>) -> Result<Self> {
        let gpu = gpu::open(adapter)?;
        Ok(Pictures(Renderer::new(&gpu, spectrum)?))
    }

    /// Returns the view fitted to the isosurfaces at `isovalues`; unchanged if they are empty.
    pub(super) fn fitted(&mut self, mut view: View, isovalues: &[f64]) -> Result<View> {
        if let Some(bounds) = self.0.bounds(isovalues, &view.keep)? {
            view.fit(self.0.volume(), bounds);
        }
        Ok(view)
    }

    /// Renders one picture as PNG.
    pub(super) fn write(
        &mut self,
        surfaces: &[Surface],
        view: &View,
        output: Output,
    ) -> Result<()> {
        let image = self.0.draw_all(surfaces, view)?;
        output.write(&Signals, |file| image.encode_png(file).map_err(|e| Error::io("", e)))?;
        Ok(())
    }
}
