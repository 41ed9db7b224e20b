//! `html`: a spectrum as one web page.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Progress as _;
use isospectrum::page::{self, DEFAULT_STEP, Link, Look, Page, Sizes};
use isospectrum::render::{Background, Image, Surface, reveal_inner};
use isospectrum::settings::IsovalueRange;
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::{Histogram, Statistics, Volume};
use isospectrum::{Error, Result};

use super::border_arguments::BorderArguments;
use super::camera_arguments::CameraArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::cutaway_arguments::CutawayArguments;
use super::interrupt::Signals;
use super::keep_arguments::KeepArguments;
use super::mark_argument::{Mark, resolved};
use super::number_argument::{not_negative, positive};
use super::progress::Bar;
use super::spectrum_file::{Opened, PACK_BYTES, check_memory};
use super::style_arguments::StyleArguments;
use super::surface_argument::SurfaceArgument;
use super::{empty, gpu, heading, report};
use isospectrum::file::Output;

/// Size of a page in bytes above which a warning is printed: it loads slowly, and mail servers refuse it.
const LARGE_PAGE: usize = 25_000_000;

const EXAMPLES: &str = "\
Examples:
  isospectrum html scan.isp -o scan.html
  Offer two named isovalues, with a title and a caption:
    isospectrum html head.isp --mark 1200=bone,-200=skin --title Head --caption 'CT, 1 mm' -o head.html
  Show slices of the volume beside the surface:
    isospectrum html scan.isp --volume scan.nrrd --slice -o scan.html
  Publish a large spectrum on a server, from which the page fetches only what is viewed:
    isospectrum html large.isp --link large.isp -o large.html";

/// Write a spectrum as one web page with a slider for the isovalue
///
/// The page is a single file. It needs no server, requests nothing from the network, and does not contain the volume, unless --slice is given. With --link it fetches the
/// isovalues that are viewed from a spectrum file on a server.
#[derive(Args, Debug)]
#[command(
    next_help_heading = heading::INPUT,
    after_long_help = EXAMPLES,
    // A page has no volume, and no axes of the world in its colours.
    mut_arg("color", |color| color.long_help(
        "Colour by curvature, component, quality, ...\n\nOne of none, quality, lifetime, curvature, component.",
    )),
)]
pub(super) struct Html {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// First isovalue: 120, 50%, p99, top:1%, ...
    ///
    /// A number, a percentage of the range (50%), a percentile of the samples (p99), standard deviations above their mean
    /// (2.5sigma), or the value that the highest 1 % of them exceed (top:1%). The default is 50%, or the nearest with a
    /// visible surface. Give the flag again for more surfaces that stay visible, with colour and opacity: -200=skin@0.3.
    /// Colour and opacity of the first apply to the surface of the slider.
    #[arg(short = 'c', long, value_name = "C", allow_hyphen_values = true)]
    isovalue: Vec<SurfaceArgument>,
    /// Publish only these isovalues, e.g. 5%:95%
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true)]
    range: Option<IsovalueRange>,
    /// Volume of the spectrum, for its histogram and slices
    ///
    /// The page contains histogram and percentiles, but no samples unless --slice is given.
    #[arg(long, value_name = "VOLUME")]
    volume: Option<PathBuf>,
    /// Show slices of the volume beside the surface
    ///
    /// The page then contains the samples of --volume, rounded to 8 bits and compressed. Isosurfaces are lines in the slices.
    #[arg(long, requires = "volume", help_heading = heading::PAGE)]
    slice: bool,
    /// Offer isovalues by name, e.g. 120=bone,40=skin
    ///
    /// Each isovalue has any form that --isovalue takes.
    #[arg(long, value_name = "C[=NAME],...", value_delimiter = ',', allow_hyphen_values = true, help_heading = heading::PAGE)]
    mark: Vec<Mark>,
    /// Heading [default: the name of the volume]
    #[arg(long, value_name = "TEXT", help_heading = heading::PAGE)]
    title: Option<String>,
    /// Text below the picture
    #[arg(long, value_name = "TEXT", help_heading = heading::PAGE)]
    caption: Option<String>,
    /// Author, at the bottom
    #[arg(long, value_name = "TEXT", hide_short_help = true, help_heading = heading::PAGE)]
    credit: Option<String>,
    #[command(flatten)]
    style: StyleArguments,
    /// Background: white, light or dark [default: that of the browser]
    #[arg(long, value_name = "COLOR", hide_short_help = true, help_heading = heading::PAGE)]
    background: Option<Background>,
    /// Draw the edges of the triangles at first
    #[arg(long, help_heading = heading::PAGE)]
    wireframe: bool,
    /// Draw the box of the volume, axes and a scale bar
    #[arg(long, hide_short_help = true, help_heading = heading::PAGE)]
    axes: bool,
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
    /// Page to write (.html), or - for stdout
    #[arg(short, long, value_name = "FILE", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Fetch the isovalues from the spectrum file at this URL
    ///
    /// A path relative to the page, or an http or https URL, at which a static server that answers range requests has the same file. The
    /// page contains only the isovalues around the first one, and fetches the others from the file when they are viewed.
    #[arg(long, value_name = "URL", conflicts_with_all = ["range", "tolerance", "step", "color_by"], help_heading = heading::OUTPUT)]
    link: Option<String>,
    /// Remove knots within this distance of the trajectory, voxels
    #[arg(long, value_name = "VOXELS", default_value_t = 0.0, value_parser = not_negative, hide_short_help = true, help_heading = heading::OUTPUT)]
    tolerance: f64,
    /// Round positions to multiples of this, voxels; along the surface to four times this
    #[arg(long, value_name = "VOXELS", default_value_t = DEFAULT_STEP, value_parser = positive, hide_short_help = true, help_heading = heading::OUTPUT)]
    step: f64,
    /// GPU for the still picture, by a part of its name
    #[arg(long, value_name = "NAME", hide_short_help = true, help_heading = heading::MACHINE)]
    adapter: Option<String>,
}

impl Html {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        Page::check_color(self.color.shown())?;
        let output = self.output()?;
        let link = self.link()?;
        if self.range.is_none() {
            check_memory(&self.spectrum, PACK_BYTES)?;
        }
        let spectrum = self.published(Opened::open(&self.spectrum)?)?;
        let (n_triangles, n_knots) = (spectrum.triangles().len(), spectrum.knots().len());
        log::info!("packing {n_triangles} triangles and {n_knots} knots into a page");
        let volume = self.volume_of(&spectrum)?;
        let statistics = volume.as_ref().map(Statistics::of).or_else(|| spectrum.statistics());
        let (first, look) = self.look(&spectrum, statistics.as_ref())?;
        let marks = resolved(&self.mark, &spectrum, statistics.as_ref())?;
        let samples = volume.as_ref().map(Histogram::of);
        let sources = self.color.sources(&spectrum, None)?;
        let isovalue = first.map_or_else(|| spectrum.shown_first(), |surface| surface.isovalue);
        empty::warn(&spectrum, isovalue, self.border.is_open(&spectrum));
        let mut page =
            Page::new(self.title.as_deref().unwrap_or(&spectrum.volume().name), isovalue)
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
                .with_slice(volume.as_ref().filter(|_| self.slice))
                .with_marks(&marks);
        let bar = Bar::new(quiet);
        bar.report(0.1, "drawing the still picture");
        let shown = first.unwrap_or_else(|| isovalue.into());
        let still = self.still(&spectrum, &page, shown)?;
        page.still = still.as_ref();
        bar.report(0.3, "packing and measuring");
        let (text, sizes) = match &link {
            Some(link) => page::linked(&spectrum, &page, link)?,
            None => page::html(&spectrum, &page)?,
        };
        let name: PathBuf = output.name().into();
        output.write_bytes(&Signals, text.as_bytes())?;
        drop(bar);
        report_sizes(&name, &spectrum, sizes, self.link.as_deref());
        Ok(())
    }

    /// Returns the link to the spectrum, if there is one.
    fn link(&self) -> Result<Option<Link>> {
        let Some(url) = &self.link else { return Ok(None) };
        let path = &self.spectrum;
        match Opened::open(path)? {
            Opened::File(_) => Link::new(url, path).map(Some),
            Opened::Whole(..) => Err(Error::Usage(format!(
                "{}: --link needs a spectrum file (.isp)",
                path.display()
            ))),
        }
    }

    /// Opens the output.
    fn output(&self) -> Result<Output> {
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let output = self.output.as_path();
        let extension = output.extension().and_then(|e| e.to_str()).unwrap_or("");
        let is_html = ["html", "htm"].iter().any(|e| extension.eq_ignore_ascii_case(e));
        if !is_html && output != Path::new("-") {
            let shown = output.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .html")));
        }
        Output::open(output, &inputs)
    }

    /// Returns the first isosurface, if given, and the look with all others.
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
        let mut surfaces = surfaces.collect::<Result<Vec<_>>>()?;
        if self.cutaway.opacity == 1.0 {
            reveal_inner(&mut surfaces);
        }
        let mut surfaces = surfaces.into_iter();
        let first = surfaces.next();
        let style = self.style.style.values();
        let look = Look {
            occlusion: self.style.occlusion.or(style.occlusion),
            light: self.style.light.unwrap_or(style.light),
            wireframe: self.wireframe,
            silhouette: self.style.silhouette,
            opacity: first
                .and_then(|surface| surface.opacity)
                .unwrap_or(self.cutaway.opacity as f32),
            clip: self.cutaway.clip.map(|clip| clip.of(spectrum.volume())),
            background: self.background.or(style.background),
            front: first.and_then(|surface| surface.color).or(style.front),
            also: surfaces.collect(),
        };
        Ok((first, look))
    }

    /// Returns the part of a spectrum that the page contains.
    fn published(&self, spectrum: Opened) -> Result<Spectrum> {
        let header = spectrum.header();
        let (of_whole, samples) = (header.range(), header.statistics());
        let spectrum = match self.range {
            Some(range) => {
                let (low, high) = range.resolve(of_whole, samples.as_ref())?;
                [low, high].into_iter().try_for_each(|c| header.check_isovalue(c))?;
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

    /// Reads the volume, if given.
    fn volume_of(&self, spectrum: &Spectrum) -> Result<Option<Volume>> {
        self.volume.as_ref().map(|path| volume_of(path, spectrum)).transpose()
    }

    /// Renders the still picture, if there is a GPU.
    fn still(&self, spectrum: &Spectrum, page: &Page<'_>, shown: Surface) -> Result<Option<Image>> {
        match gpu::open(self.adapter.as_deref()) {
            Ok(gpu) => page::still(&gpu, spectrum, page, shown).map(Some),
            Err(Error::Gpu(why)) => {
                log::info!("no still picture: {why}");
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

/// Reports the sizes of a page and its parts.
fn report_sizes(name: &Path, spectrum: &Spectrum, sizes: Sizes, link: Option<&str>) {
    let per = |n: usize| sizes.data as f64 / n.max(1) as f64;
    let in_file = link.map_or_else(String::new, |url| format!(" in {url}"));
    let slice = match sizes.slice {
        0 => String::new(),
        n => format!("samples {}, ", report::bytes(n as u64)),
    };
    log::info!(
        "{}: {}, of which script {}, still picture {}, {slice}first isovalues {}, spectrum {}{in_file} ({:.2} bytes per triangle, {:.2} per knot)",
        name.display(),
        report::bytes(sizes.page as u64),
        report::bytes(sizes.script as u64),
        report::bytes(sizes.still as u64),
        report::bytes(sizes.first as u64),
        report::bytes(sizes.data as u64),
        per(spectrum.triangles().len()),
        per(spectrum.knots().len()),
    );
    if sizes.page > LARGE_PAGE {
        log::warn!(
            "the page is large ({}) and loads slowly; --range, --tolerance and --step make it smaller, \
             --link leaves the isovalues in the spectrum file on a server",
            report::bytes(sizes.page as u64)
        );
    }
}
