//! `render`: a picture of the mesh at one isovalue, or many along a sweep, without a window.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, ValueEnum};

use isospectrum::render::Gpu;
use isospectrum::render::{Background, Light, Renderer, Surface, View};
use isospectrum::spectrum::Spectrum;
use isospectrum::{Error, Result};

use isospectrum::Progress as _;

use super::border_arguments::BorderArguments;
use super::camera_arguments::CameraArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::frames::{MOST, Sweep};
use super::keep_arguments::KeepArguments;
use super::output::{Output, no_path};
use super::progress::Bar;
use super::series::Series;
use super::sight_arguments::SightArguments;
use super::spectrum_file::Opened;
use super::surface_argument::SurfaceArgument;
use super::{empty, report};

/// Render the mesh at one isovalue to a picture, or a sweep over isovalues or a turntable to many
#[derive(Args, Debug)]
pub(super) struct Render {
    /// Spectrum (.isp, or a folder .ispt)
    spectrum: PathBuf,
    /// Isovalue: a number, 50% of the range, p99 of the samples, 2.5sigma above their mean, or top:1% of them; with a
    /// colour (a name or #rrggbb) and an opacity if wanted; again for several in one picture: -c 120=bone -c 40=skin@0.3
    #[arg(
        short = 'c',
        long,
        value_name = "C[=COLOR][@OPACITY]",
        allow_hyphen_values = true,
        required_unless_present = "sweep"
    )]
    isovalue: Vec<SurfaceArgument>,
    /// Isovalues of a film: N pictures from A to B, e.g. 10%:90%:120; -o takes a pattern such as
    /// frames/%04d.png, numbered from 0, or a film (.mp4, .webm), which ffmpeg makes
    #[arg(long, value_name = "A:B:N", allow_hyphen_values = true, conflicts_with = "isovalue")]
    sweep: Option<Sweep>,
    /// N pictures all around the axis that points up, all in one size; -o as for --sweep
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=i64::from(MOST)), conflicts_with = "sweep")]
    turntable: Option<u32>,
    /// Pictures per second of a film; 30 where it is not told
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240))]
    fps: Option<u32>,
    /// Picture to write (.png); - is stdout. Of several pictures a pattern or a film
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Width and height, pixels
    #[arg(long, value_name = "WxH", default_value = "1024x768")]
    size: Size,
    #[command(flatten)]
    camera: CameraArguments,
    /// What fills the picture: the surface (those of all pictures of a sweep), or the volume, so that pictures of
    /// several isovalues show all in one size
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = Fit::Surface)]
    fit: Fit,
    /// What lies behind the surface: white, light, dark or transparent
    #[arg(long, value_name = "WHAT", default_value = "white")]
    background: Background,
    #[command(flatten)]
    sight: SightArguments,
    /// Darken hollows, by what is seen around each point: shows form where noise hides it
    #[arg(long)]
    occlusion: bool,
    /// Where the main light is, as seen by who looks: upper-left, eye (no shadow), left, right, above or below
    #[arg(long, value_name = "WHERE", default_value = "upper-left")]
    light: Light,
    /// Draw the edges of the triangles
    #[arg(long)]
    wireframe: bool,
    #[command(flatten)]
    color: ColorArguments,
    /// The volume of the spectrum, for --color distance
    #[arg(long, value_name = "VOLUME")]
    volume: Option<PathBuf>,
    /// Leave out the legend of the colours
    #[arg(long)]
    no_legend: bool,
    /// Draw the box of the volume, the axes of the world and a scale bar
    #[arg(long)]
    axes: bool,
    /// A bar that tells how long things are, in the unit of the volume
    #[arg(long)]
    scale_bar: bool,
    /// Words at the top of the picture; {isovalue} stands for the isovalue
    #[arg(long, value_name = "TEXT")]
    label: Option<String>,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    keep: KeepArguments,
    /// Adapter to use, by a part of its name
    #[arg(long, value_name = "NAME")]
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
            return Err(Error::Usage("--fps, expected with --sweep or --turntable".into()).into());
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
        let isovalues = self.isovalues(spectrum.told())?;
        let spectrum = spectrum.around(&isovalues)?;
        let (surfaces, isovalues) = self.surfaces(&spectrum)?;
        let mut pictures = self.pictures(&spectrum)?;
        let mut view = self.fit.of(self.view(&spectrum), &mut pictures, &isovalues)?;
        view.label = self.label(&isovalues);
        pictures.write(&surfaces, &view, output)?;
        empty::warn_of_components(pictures.0.n_triangles(), &view.keep);
        let Size { width, height } = self.size;
        let shown: Vec<String> = isovalues.into_iter().map(report::number).collect();
        let shown = shown.join(", ");
        log::info!("{}: {width}x{height} pixels, isovalue {shown}", self.output.display());
        Ok(())
    }

    /// Renders every picture of a sweep.
    fn run_sweep(&self, sweep: Sweep, quiet: bool) -> anyhow::Result<()> {
        let series = self.series()?;
        let spectrum = Opened::open(&self.spectrum)?;
        let isovalues = sweep.in_spectrum(spectrum.told())?;
        let spectrum = spectrum.around(&isovalues)?;
        let mut pictures = self.pictures(&spectrum)?;
        let view = self.fit.of(self.view(&spectrum), &mut pictures, &isovalues)?;
        let frame = |&c: &f64| (vec![Surface::from(c)], view.clone().with_label(self.label(&[c])));
        let frames: Vec<_> = isovalues.iter().map(frame).collect();
        self.write_series(&mut pictures, &frames, &series, quiet)?;
        let is_empty = |&&c: &&f64| empty::is_empty(&spectrum, c, self.border.is_open(&spectrum));
        let n_empty = isovalues.iter().filter(is_empty).count();
        if n_empty > 0 {
            log::warn!("{n_empty} of {} pictures show no surface", isovalues.len());
        }
        Ok(())
    }

    /// Renders a picture from every side.
    fn run_turntable(&self, n: u32, quiet: bool) -> anyhow::Result<()> {
        let series = self.series()?;
        let spectrum = Opened::open(&self.spectrum)?;
        let isovalues = self.isovalues(spectrum.told())?;
        let spectrum = spectrum.around(&isovalues)?;
        let (surfaces, isovalues) = self.surfaces(&spectrum)?;
        let mut pictures = self.pictures(&spectrum)?;
        let view = self.view(&spectrum).with_label(self.label(&isovalues));
        let bounds = match self.fit {
            Fit::Surface => pictures.0.bounds(&isovalues, &view.keep)?,
            Fit::Volume => None,
        };
        let views = view.turntable(spectrum.volume(), bounds, n);
        let frames: Vec<_> = views.into_iter().map(|view| (surfaces.clone(), view)).collect();
        self.write_series(&mut pictures, &frames, &series, quiet)?;
        empty::warn_of_components(pictures.0.n_triangles(), &view.keep);
        Ok(())
    }

    /// Renders pictures one after the other. Each of several files appears when it is complete, a film as a whole.
    fn write_series(
        &self,
        pictures: &mut Pictures<'_>,
        frames: &[(Vec<Surface>, View)],
        series: &Series,
        quiet: bool,
    ) -> anyhow::Result<()> {
        let n = frames.len() as u32;
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let mut written = series.open(n, &inputs)?;
        let bar = Bar::new(quiet);
        for (i, (surfaces, view)) in frames.iter().enumerate() {
            if bar.cancelled() {
                return Err(Error::Interrupted.into());
            }
            bar.report(i as f64 / f64::from(n), "rendering");
            written.add(&pictures.0.draw_all(surfaces, view)?)?;
        }
        written.finish(self.background)?;
        drop(bar);
        let Size { width, height } = self.size;
        log::info!("{}: {n} pictures of {width}x{height} pixels", series.names(n));
        Ok(())
    }

    /// Where pictures one after the other go.
    fn series(&self) -> Result<Series> {
        Series::of(&self.output, self.fps, self.size, self.background)
    }

    /// The isovalues that are asked for, all in the range.
    fn isovalues(&self, told: &Spectrum) -> Result<Vec<f64>> {
        let isovalue = |c: &SurfaceArgument| {
            let isovalue = c.in_spectrum(told)?.isovalue;
            told.check_isovalue(isovalue).map(|()| isovalue)
        };
        self.isovalue.iter().map(isovalue).collect()
    }

    /// The isosurfaces that are asked for, and their isovalues; warns of those that are empty.
    fn surfaces(&self, spectrum: &Spectrum) -> Result<(Vec<Surface>, Vec<f64>)> {
        let surfaces: Vec<Surface> =
            self.isovalue.iter().map(|c| c.in_spectrum(spectrum)).collect::<Result<_>>()?;
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        for &isovalue in &isovalues {
            spectrum.check_isovalue(isovalue)?;
            empty::warn(spectrum, isovalue, self.border.is_open(spectrum));
        }
        Ok((surfaces, isovalues))
    }

    /// The words at the top of a picture of isovalues.
    fn label(&self, isovalues: &[f64]) -> Option<String> {
        let shown: Vec<String> = isovalues.iter().map(|&c| report::number(c)).collect();
        self.label.as_ref().map(|label| label.replace("{isovalue}", &shown.join(", ")))
    }

    /// What draws the pictures of a spectrum.
    fn pictures<'a>(&self, spectrum: &'a Spectrum) -> Result<Pictures<'a>> {
        let volume = self.volume.as_ref().map(|path| volume_of(path, spectrum)).transpose()?;
        let sources = self.color.sources(spectrum, volume)?;
        let mut pictures = Pictures::open(spectrum, self.adapter.as_deref())?;
        pictures.0.set_sources(sources);
        Ok(pictures)
    }

    fn view(&self, spectrum: &Spectrum) -> View {
        let Size { width, height } = self.size;
        View::default()
            .with_width(width)
            .with_height(height)
            .with_camera(self.camera.camera())
            .with_wireframe(self.wireframe.then_some(1.0))
            .with_color(self.color.shown())
            .with_map(self.color.color_map)
            .with_ends(self.color.ends())
            .with_clip(self.sight.clip.map(|clip| clip.of(spectrum.volume())))
            .with_legend(!self.no_legend)
            .with_axes(self.axes)
            .with_scale_bar(self.scale_bar || self.axes)
            .with_open(self.border.is_open(spectrum))
            .with_keep(self.keep.of(spectrum))
            .with_background(self.background)
            .with_opacity(self.sight.opacity as f32)
            .with_occlusion(self.occlusion)
            .with_light(self.light)
    }
}

/// What fills a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Fit {
    /// The isosurfaces that are shown.
    Surface,
    /// The whole volume.
    Volume,
}

impl Fit {
    /// The view that fits pictures of `isovalues`.
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
        let gpu = Gpu::new(adapter)?;
        Ok(Pictures(Renderer::new(&gpu, spectrum)?))
    }

    /// A view that fits the isosurfaces of `isovalues`, where there are any to see.
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
        output.write(|file| image.encode_png(file).map_err(no_path))?;
        Ok(())
    }
}

/// `1024x768`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    pub(super) width: u32,
    pub(super) height: u32,
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |digits: &str| digits.parse().ok().filter(|n| (1..=16384).contains(n));
        let sides = text.split_once(['x', 'X']);
        sides
            .and_then(|(w, h)| Some(Size { width: side(w)?, height: side(h)? }))
            .ok_or_else(|| format!("'{text}', expected e.g. 1024x768, each from 1 to 16384"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_a_width_and_a_height() {
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
        for wrong in ["", "640", "0x480", "640x480x3", "-1x2", "99999x1"] {
            assert!(wrong.parse::<Size>().is_err(), "{wrong}");
        }
    }
}
