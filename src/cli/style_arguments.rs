//! The style of a picture, of the window or of a page, and the flags that take precedence over it.

use clap::Args;

use isospectrum::render::{Light, Style, View};

use super::heading;

/// See the module.
#[derive(Args, Debug)]
pub(super) struct StyleArguments {
    /// Background, light and colour: paper, studio, ...
    ///
    /// One of default, paper (white, a muted colour, occlusion), studio (dark, a warm colour, occlusion), flat (light from the eye,
    /// no occlusion). --light, --occlusion, --background and colours of --isovalue take precedence. The reader of a page
    /// can choose another one.
    #[arg(long, value_name = "NAME", default_value = "default", hide_default_value = true, help_heading = heading::PICTURE)]
    pub(super) style: Style,
    /// Light from upper-left, eye, left, ...
    ///
    /// One of upper-left, eye, left, right, above, below.
    /// Direction of the main light, relative to the viewer. `eye` casts no shadow.
    #[arg(long, value_name = "FROM", hide_short_help = true, help_heading = heading::PICTURE)]
    pub(super) light: Option<Light>,
    /// Darken hollows
    ///
    /// Ambient occlusion in screen space. It shows form where noise hides it. `--occlusion=false`: not, whatever the style. A page
    /// without a style has it where the browser draws with WebGPU on a GPU.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true", hide_possible_values = true, help_heading = heading::PICTURE)]
    pub(super) occlusion: Option<bool>,
    /// Draw thin lines where the surface turns away
    #[arg(long, hide_short_help = true, help_heading = heading::PICTURE)]
    pub(super) silhouette: bool,
}

impl StyleArguments {
    /// The default view with this style, light and occlusion.
    pub(super) fn view(&self) -> View {
        let view = View::default().with_style(self.style);
        let (light, occlusion) = (view.light, view.occlusion);
        view.with_light(self.light.unwrap_or(light))
            .with_occlusion(self.occlusion.unwrap_or(occlusion))
            .with_silhouette(self.silhouette)
    }
}
