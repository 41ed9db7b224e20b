//! `view` where the program was built without the window.

use clap::Args;
use isospectrum::Error;

/// Open a window on a spectrum (not in this build)
#[derive(Args, Debug)]
pub(super) struct View {
    /// Whatever the window would take
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _arguments: Vec<std::ffi::OsString>,
}

impl View {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let how =
            "this build has no window, expected one made with: cargo install --features viewer";
        Err(Error::Usage(how.to_owned()).into())
    }
}
