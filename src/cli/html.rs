//! `html`: a spectrum as one web page that anyone can open.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Progress as _;
use isospectrum::color::ColorSources;
use isospectrum::file::TemporaryFolder;
use isospectrum::page::{self, DEFAULT_STEP, Look, Page, Sizes};
use isospectrum::render::Gpu;
use isospectrum::render::{Background, Image, Light, Renderer, Surface, View};
use isospectrum::settings::IsovalueRange;
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::{Histogram, Statistics, Volume};
use isospectrum::{Error, Result};

use super::border_arguments::BorderArguments;
use super::camera_arguments::CameraArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::compute::{not_negative, positive};
use super::keep_arguments::KeepArguments;
use super::mark_argument::{Mark, resolved};
use super::output::Output;
use super::progress::Bar;
use super::sight_arguments::SightArguments;
use super::spectrum_file::Opened;
use super::surface_argument::SurfaceArgument;
use super::{empty, report};

/// Pages of more bytes than this are warned of: they load slowly and are hard to send.
const LARGE: usize = 25_000_000;

/// Write a spectrum as one web page with a slider for the isovalue
///
/// The page is a single file without a server, it asks the network for nothing and does not hold
/// the volume.
#[derive(Args, Debug)]
pub(super) struct Html {
    /// Spectrum (.isp, or a folder .ispt)
    spectrum: PathBuf,
    /// Page to write (.html); - is stdout
    #[arg(short, long, value_name = "FILE", required_unless_present = "split")]
    output: Option<PathBuf>,
    /// Write a small page and files of isovalues into this folder, for any static server: no more is fetched than is looked at
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["output", "color_by"])]
    split: Option<PathBuf>,
    /// Isovalue it opens at: a number, 50% of the range, p99 of the samples, 2.5sigma above their mean, or top:1% of
    /// them; else 50%, or the nearest with more than a trace to see. Again for others that stay in sight, each as render
    /// takes it, e.g. 1200=bone or -200=skin@0.3; the first one's colour and opacity are those of the slider's
    #[arg(short = 'c', long, value_name = "C[=COLOR][@OPACITY]", allow_hyphen_values = true)]
    isovalue: Vec<SurfaceArgument>,
    /// Isovalues to offer by name, e.g. 120=bone,40=skin,top:1%; each written as --isovalue
    #[arg(long, value_name = "C[=NAME],...", value_delimiter = ',', allow_hyphen_values = true)]
    mark: Vec<Mark>,
    /// Heading of the page; else the name of the volume
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// What is to be seen, below the picture
    #[arg(long, value_name = "TEXT")]
    caption: Option<String>,
    /// Whose work it is, at the bottom
    #[arg(long, value_name = "TEXT")]
    credit: Option<String>,
    /// Publish these isovalues only; each a number or a percentage of the range
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true)]
    range: Option<IsovalueRange>,
    /// Leave out knots within this distance of the trajectory that remains, voxels
    #[arg(long, value_name = "VOXELS", default_value_t = 0.0, value_parser = not_negative)]
    tolerance: f64,
    /// Round positions to whole multiples of this across the surface, and of four times this along it, voxels
    #[arg(long, value_name = "VOXELS", default_value_t = DEFAULT_STEP, value_parser = positive)]
    step: f64,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    color: ColorArguments,
    /// Draw the box of the volume, the axes of the world and a scale bar
    #[arg(long)]
    axes: bool,
    /// Darken hollows at first, by what is seen around each point: shows form where noise hides it
    #[arg(long)]
    occlusion: bool,
    /// Where the main light is at first, as seen by who looks: upper-left, eye (no shadow), left, right, above or below
    #[arg(long, value_name = "WHERE", default_value = "upper-left")]
    light: Light,
    /// Draw the edges of the triangles at first
    #[arg(long)]
    wireframe: bool,
    /// What lies behind the surface at first: white, light or dark; else what the reader's page is like
    #[arg(long, value_name = "WHAT")]
    background: Option<Background>,
    #[command(flatten)]
    sight: SightArguments,
    #[command(flatten)]
    keep: KeepArguments,
    /// The volume itself (.nrrd, .npy, or .raw with dimensions and type in its name): its histogram
    /// and percentiles go into the page, its samples do not
    #[arg(long, value_name = "VOLUME")]
    volume: Option<PathBuf>,
    /// Adapter for the still picture, by a part of its name
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

impl Html {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        let target = self.target()?;
        let spectrum = self.published(Opened::open(&self.spectrum)?)?;
        let (n_triangles, n_knots) = (spectrum.triangles().len(), spectrum.knots().len());
        log::info!("packing {n_triangles} triangles and {n_knots} knots into a page");
        let volume = self.volume_of(&spectrum)?;
        let statistics = volume.as_ref().map(Statistics::of).or_else(|| spectrum.statistics());
        let (told, look) = self.look(&spectrum, statistics.as_ref())?;
        let marks = resolved(&self.mark, &spectrum, statistics.as_ref())?;
        let samples = volume.as_ref().map(Histogram::of);
        let sources = self.color.sources(&spectrum, None)?;
        let isovalue = told.map_or_else(|| spectrum.shown_first(), |surface| surface.isovalue);
        empty::warn(&spectrum, isovalue, self.border.is_open(&spectrum));
        let bar = Bar::new(quiet);
        bar.report(0.1, "drawing the still picture");
        let shown = told.unwrap_or_else(|| isovalue.into());
        let still = self.still(&spectrum, shown, &look, &sources)?;
        let page = Page::new(self.title.as_deref().unwrap_or(&spectrum.volume().name), isovalue)
            .with_caption(self.caption.as_deref())
            .with_credit(self.credit.as_deref())
            .with_step(self.step)
            .with_open(self.border.is_open(&spectrum))
            .with_camera(self.camera.camera())
            .with_color(self.color.shown())
            .with_map(self.color.color_map)
            .with_ends(self.color.ends())
            .with_field(&sources)
            .with_axes(self.axes)
            .with_look(look)
            .with_keep(self.keep.of(&spectrum))
            .with_samples(samples.as_ref())
            .with_statistics(statistics.as_ref())
            .with_marks(&marks)
            .with_still(still.as_ref());
        bar.report(0.3, "packing and measuring");
        let (name, sizes, n_files) = match target {
            Target::File(output) => {
                let (text, sizes) = page::html(&spectrum, &page)?;
                let name = output.name().into();
                output.write_bytes(text.as_bytes())?;
                (name, sizes, 0)
            }
            Target::Folder(path) => {
                let split = page::split(&spectrum, &page)?;
                write_folder(&split.files, &path)?;
                (path, split.sizes, split.files.len() - 1)
            }
        };
        drop(bar);
        tell(&name, &spectrum, sizes, n_files);
        Ok(())
    }

    /// Where the page goes, which could be written to.
    fn target(&self) -> Result<Target> {
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        if let Some(path) = &self.split {
            Output::check_apart(path, &inputs)?;
            // As in the end; gone again at once.
            TemporaryFolder::next_to_folder(path, is_split)?;
            return Ok(Target::Folder(path.clone()));
        }
        let output = self.output.as_deref().unwrap_or(Path::new("-"));
        let extension = output.extension().and_then(|e| e.to_str()).unwrap_or("");
        let is_html = ["html", "htm"].iter().any(|e| extension.eq_ignore_ascii_case(e));
        if !is_html && output != Path::new("-") {
            let shown = output.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .html")));
        }
        Output::open(output, &inputs).map(Target::File)
    }

    /// The first isosurface, if it is told, and how it looks beside which others.
    fn look(
        &self,
        spectrum: &Spectrum,
        samples: Option<&Statistics>,
    ) -> Result<(Option<Surface>, Look)> {
        if self.background == Some(Background::Transparent) {
            return Err(Error::Usage(
                "background 'transparent', expected white, light or dark".into(),
            ));
        }
        let surfaces =
            self.isovalue.iter().map(|surface| surface.resolve(spectrum.range(), samples));
        let mut surfaces = surfaces.collect::<Result<Vec<_>>>()?.into_iter();
        let first = surfaces.next();
        let mut look = Look::default();
        look.occlusion = self.occlusion;
        look.light = self.light;
        look.wireframe = self.wireframe;
        look.opacity =
            first.and_then(|surface| surface.opacity).unwrap_or(self.sight.opacity as f32);
        look.clip = self.sight.clip.map(|clip| clip.of(spectrum.volume()));
        look.background = self.background;
        look.front = first.and_then(|surface| surface.color);
        look.also = surfaces.collect();
        Ok((first, look))
    }

    /// What of a spectrum goes into the page.
    fn published(&self, spectrum: Opened) -> Result<Spectrum> {
        let told = spectrum.told();
        let (of_whole, samples) = (told.range(), told.statistics());
        let spectrum = match self.range {
            Some(range) => {
                let (low, high) = range.resolve(of_whole, samples.as_ref())?;
                [low, high].into_iter().try_for_each(|c| told.check_isovalue(c))?;
                page::with_range(&spectrum.around(&[low, high])?, (low, high))?
            }
            None => spectrum.around(&[of_whole.0, of_whole.1])?,
        };
        Ok(if self.tolerance > 0.0 {
            page::with_fewer_knots(&spectrum, self.tolerance)
        } else {
            spectrum
        })
    }

    /// The volume, if it is given.
    fn volume_of(&self, spectrum: &Spectrum) -> Result<Option<Volume>> {
        self.volume.as_ref().map(|path| volume_of(path, spectrum)).transpose()
    }

    /// The picture for those who can see no other, if there is an adapter to draw it.
    fn still(
        &self,
        spectrum: &Spectrum,
        shown: Surface,
        look: &Look,
        sources: &ColorSources,
    ) -> Result<Option<Image>> {
        let gpu = match Gpu::new(self.adapter.as_deref()) {
            Ok(gpu) => gpu,
            Err(Error::Gpu(why)) => {
                log::info!("the page has no still picture: {why}");
                return Ok(None);
            }
            Err(error) => return Err(error),
        };
        let mut view = View::default()
            .with_width(640)
            .with_height(480)
            .with_open(self.border.is_open(spectrum))
            .with_keep(self.keep.of(spectrum))
            .with_camera(self.camera.camera())
            .with_background(Background::Transparent)
            .with_color(self.color.shown())
            .with_map(self.color.color_map)
            .with_ends(self.color.ends())
            .with_occlusion(look.occlusion)
            .with_light(look.light)
            .with_wireframe(look.wireframe.then_some(1.0))
            .with_clip(look.clip)
            .with_opacity(look.opacity);
        let mut renderer = Renderer::new(&gpu, spectrum)?;
        renderer.set_sources(sources.clone());
        let surfaces: Vec<Surface> =
            std::iter::once(shown).chain(look.also.iter().copied()).collect();
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        if let Some(bounds) = renderer.bounds(&isovalues, &view.keep)? {
            view.fit(spectrum.volume(), bounds);
        }
        renderer.draw_all(&surfaces, &view).map(Some)
    }
}

/// Where a page goes.
enum Target {
    File(Output),
    /// With files of isovalues beside it.
    Folder(PathBuf),
}

/// Whether a folder has nothing but what `--split` writes: such a one may be replaced.
fn is_split(path: &Path) -> bool {
    let Ok(found) = std::fs::read_dir(path) else { return false };
    let is_own = |name: std::ffi::OsString| name.to_str().is_some_and(page::is_split_name);
    found.into_iter().all(|entry| entry.is_ok_and(|entry| is_own(entry.file_name())))
}

/// Writes a page and its files where there is nothing, or another page with its files.
fn write_folder(files: &[(String, Vec<u8>)], path: &Path) -> Result<()> {
    let work = TemporaryFolder::next_to_folder(path, is_split)?;
    let made = work.path().join("made");
    std::fs::create_dir(&made).map_err(|e| Error::io(path, e))?;
    for (name, bytes) in files {
        std::fs::write(made.join(name), bytes).map_err(|e| Error::io(path, e))?;
    }
    work.move_folder("made", path)
}

fn tell(name: &Path, spectrum: &Spectrum, sizes: Sizes, n_files: usize) {
    let per = |n: usize| sizes.data as f64 / n.max(1) as f64;
    let beside = if n_files > 0 { format!(" in {n_files} files beside it") } else { String::new() };
    log::info!(
        "{}: {}, of which script {}, still picture {}, first isovalues {}, spectrum {}{beside} ({:.2} bytes per triangle, {:.2} per knot)",
        name.display(),
        report::bytes(sizes.page as u64),
        report::bytes(sizes.script as u64),
        report::bytes(sizes.still as u64),
        report::bytes(sizes.first as u64),
        report::bytes(sizes.data as u64),
        per(spectrum.triangles().len()),
        per(spectrum.knots().len()),
    );
    if sizes.page > LARGE {
        log::warn!(
            "the page is large ({}): it loads slowly and is hard to send; \
             --range, --tolerance and --step make it smaller, --split has files fetched as they are wanted",
            report::bytes(sizes.page as u64)
        );
    }
}
