//! Where the vertex- and triangle-parallel stages run, as said on the command line.

use clap::{Args, ValueEnum};
use isospectrum::gpu::Gpu;
use isospectrum::kernels::Backend;
use isospectrum::{Error, Result};

/// The arguments wherever something is computed.
#[derive(Args, Debug)]
pub(super) struct BackendArguments {
    /// Where the vertex- and triangle-parallel stages run
    #[arg(long, value_name = "BACKEND", default_value = "auto")]
    backend: Choice,
    /// Adapter to use, by a part of its name
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Threads on the CPU [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Choice {
    /// A GPU where there is one, else the CPU; a software adapter is slower than our own CPU code
    Auto,
    /// An adapter; an error where there is none
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
        if let Some(n) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n));
            pool.build_global().map_err(|error| Error::Usage(format!("--threads {n}: {error}")))?;
        }
        if self.backend == Choice::Cpu && self.adapter.is_some() {
            return Err(Error::Usage("--adapter has no meaning with --backend cpu".to_owned()));
        }
        match self.backend {
            Choice::Cpu => Ok(Backend::Cpu),
            Choice::Gpu => Ok(Backend::Gpu(Gpu::open(self.adapter())?)),
            // An adapter that was named is wanted, whatever it is.
            Choice::Auto if self.adapter.is_some() => Ok(Backend::Gpu(Gpu::open(self.adapter())?)),
            Choice::Auto => Ok(match Gpu::open(None) {
                Ok(gpu) if is_hardware(&gpu) => Backend::Gpu(gpu),
                Ok(_) => Backend::Cpu,
                Err(why) => {
                    log::debug!("computing on the CPU: {why}");
                    Backend::Cpu
                }
            }),
        }
    }
}

fn is_hardware(gpu: &Gpu) -> bool {
    gpu.adapter.get_info().device_type != wgpu::DeviceType::Cpu
}
