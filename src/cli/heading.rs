//! Headings of the groups of flags in `--help`.

pub(super) const INPUT: &str = "Input";
pub(super) const REGION: &str = "Region and noise";
pub(super) const TRACKING: &str = "Tracking";
pub(super) const QUALITY: &str = "Mesh quality";
pub(super) const SURFACE: &str = "Surface";
pub(super) const COMPONENTS: &str = "Components";
pub(super) const COLORS: &str = "Colours";
pub(super) const CAMERA: &str = "Camera";
pub(super) const PICTURE: &str = "Picture";
pub(super) const PAGE: &str = "Page";
#[cfg(feature = "viewer")]
pub(super) const WINDOW: &str = "Window";
pub(super) const CHECKS: &str = "Checks and limits";
pub(super) const OUTPUT: &str = "Output";
pub(super) const MACHINE: &str = "Machine";
pub(super) const GENERAL: &str = "General";
