//! Where the vertex- and triangle-parallel stages run, as said on the command line.

use clap::{Args, ValueEnum};
use isospectrum::{Backend, Choice};
use isospectrum::{Error, Result};

/// The arguments wherever something is computed.
#[derive(Args, Debug)]
pub(super) struct BackendArguments {
    /// Where the vertex- and triangle-parallel stages run
    #[arg(long, value_name = "BACKEND", default_value = "auto")]
    backend: Wanted,
    /// Adapter to use, by a part of its name
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Threads on the CPU [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Wanted {
    /// A GPU where there is one, else the CPU
    Auto,
    /// A GPU; an error where there is none
    Gpu,
    /// The CPU
    Cpu,
}

impl BackendArguments {
    /// The adapter asked for.
    pub(super) fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// Opens the backend, and sets the number of threads of the whole program.
    pub(super) fn open(&self) -> Result<Backend> {
        if self.backend == Wanted::Cpu && self.adapter.is_some() {
            return Err(Error::Usage("--adapter has no meaning with --backend cpu".to_owned()));
        }
        if let Some(n) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n));
            pool.build_global().map_err(|error| Error::Usage(format!("--threads {n}: {error}")))?;
        }
        let choice = match self.backend {
            Wanted::Auto => Choice::Auto,
            Wanted::Gpu => Choice::Gpu,
            Wanted::Cpu => Choice::Cpu,
        };
        Backend::choose(choice, self.adapter())
    }
}
