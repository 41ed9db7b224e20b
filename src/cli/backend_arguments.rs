//! Flags that select GPU or CPU and the number of threads.

use clap::{Args, ValueEnum};
use isospectrum::{Backend, Choice};
use isospectrum::{Error, Result};

use super::{driver_warning, gpu, heading, threads};

/// The flags of every command that computes a spectrum.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::MACHINE)]
pub(super) struct BackendArguments {
    /// Compute on auto, gpu or cpu
    ///
    /// Selects where the stages run that are parallel over vertices and triangles.
    #[arg(long, value_name = "BACKEND", default_value = "auto")]
    #[arg(hide_possible_values = true)]
    backend: BackendChoice,
    /// GPU to use, by a part of its name
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    adapter: Option<String>,
    /// Number of CPU threads [default: all]
    ///
    /// At most four are started for each processor.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BackendChoice {
    /// The GPU if there is one, else the CPU
    Auto,
    /// The GPU; fail if there is none
    Gpu,
    /// The CPU
    Cpu,
}

impl BackendArguments {
    /// Returns a part of the name of the requested adapter.
    pub(super) fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// Opens the backend, and sets the number of threads of the whole program.
    pub(super) fn open(&self) -> Result<Backend> {
        if self.backend == BackendChoice::Cpu && self.adapter.is_some() {
            return Err(Error::Usage(
                "--adapter selects a GPU, which --backend cpu does not use".to_owned(),
            ));
        }
        if let Some(n) = self.threads {
            threads::start_requested(usize::from(n))?;
        }
        let choice = match self.backend {
            BackendChoice::Cpu => Choice::Cpu,
            BackendChoice::Auto if self.adapter.is_none() && gpu::check_room().is_err() => {
                Choice::Cpu
            }
            BackendChoice::Auto => Choice::Auto,
            BackendChoice::Gpu => Choice::Gpu,
        };
        if choice != Choice::Cpu {
            gpu::check_room()?;
        }
        driver_warning::hidden(|| Backend::choose(choice, self.adapter()))
    }
}
