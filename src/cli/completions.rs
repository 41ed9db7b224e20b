//! `completions`: completion scripts for shells.

use clap::Args;
use clap_complete::Shell;

use super::output;

/// Print the completion script for a shell
#[derive(Args, Debug)]
#[command(next_help_heading = super::heading::INPUT)]
#[command(
    after_long_help = "Examples:\n  isospectrum completions bash > ~/.local/share/bash-completion/completions/isospectrum"
)]
pub(super) struct Completions {
    /// Shell
    shell: Shell,
}

impl Completions {
    /// Prints the script for the whole command line, `command`.
    pub(super) fn run(&self, command: &mut clap::Command) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, command, "isospectrum", &mut script);
        Ok(output::print(&String::from_utf8_lossy(&script))?)
    }
}
