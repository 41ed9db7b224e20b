//! `view` in a program built without the feature `viewer`.

use clap::Args;
use isospectrum::Error;

/// Open a window on a spectrum (not in this build)
#[derive(Args, Debug)]
pub(super) struct View {
    /// Arguments of the window
    #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
    _arguments: Vec<std::ffi::OsString>,
}

impl View {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let message = "this build has no window, expected a build with --features viewer";
        Err(Error::Usage(message.to_owned()).into())
    }
}
