//! Adapters, which are looked for when they are first needed, and then kept: opening one takes half a second.

use std::sync::{Arc, Mutex, PoisonError};

use isospectrum::render::Gpu;
use isospectrum::{Backend, Choice, Error, Result};
use pyo3::prelude::*;

use crate::arguments::choice_of;
use crate::watch::detached;

/// Samples from which an adapter is looked for without being asked for: those of 32^3, whose sweep takes about as long as opening one.
const MIN_SAMPLES: usize = 1 << 15;

/// The variable without which the Wayland library prints an error to stderr while adapters are listed.
const WAYLAND_VARIABLE: &str = "XDG_RUNTIME_DIR";

/// Opened things by what was asked for.
type Opened<K, T> = Mutex<Vec<(K, Arc<T>)>>;

static BACKENDS: Opened<(Choice, Option<String>), Backend> = Mutex::new(Vec::new());
static GPUS: Opened<Option<String>, Gpu> = Mutex::new(Vec::new());

/// Where to look for a backend.
pub(crate) struct Wanted {
    choice: Choice,
    adapter: Option<String>,
}

impl Wanted {
    /// By the arguments `backend` and `adapter`, for a volume of so many samples.
    pub(crate) fn new(
        backend: &str,
        adapter: Option<String>,
        n_samples: usize,
    ) -> PyResult<Wanted> {
        let choice = match choice_of(backend)? {
            Choice::Auto if adapter.is_none() && n_samples < MIN_SAMPLES => Choice::Cpu,
            choice => choice,
        };
        Ok(Wanted { choice, adapter })
    }

    /// The backend, opened on first use.
    pub(crate) fn open(self, py: Python<'_>) -> PyResult<Arc<Backend>> {
        let Wanted { choice, adapter } = self;
        let is_intact = |b: &Backend| b.gpu().is_none_or(|gpu| gpu.check().is_ok());
        let open = |(choice, adapter): &(Choice, Option<String>)| {
            Backend::choose(*choice, adapter.as_deref())
        };
        if choice == Choice::Cpu {
            return detached(py, || Backend::choose(choice, None).map(Arc::new));
        }
        kept(py, &BACKENDS, (choice, adapter), is_intact, open)
    }
}

/// The adapter for pictures, opened on first use.
pub(crate) fn gpu(py: Python<'_>, adapter: Option<String>) -> PyResult<Arc<Gpu>> {
    kept(py, &GPUS, adapter, |gpu| gpu.check().is_ok(), |adapter| Gpu::new(adapter.as_deref()))
}

/// As [`gpu`]; `None` where there is none.
pub(crate) fn gpu_if_any(py: Python<'_>) -> PyResult<Option<Arc<Gpu>>> {
    match gpu(py, None) {
        Err(error)
            if error.is_instance(py, &py.import("isospectrum._errors")?.getattr("GpuError")?) =>
        {
            Ok(None)
        }
        found => found.map(Some),
    }
}

/// What was opened for `key` before, if it is intact; otherwise opens it.
fn kept<K: PartialEq + Clone + Send + Sync, T: Send + Sync>(
    py: Python<'_>,
    all: &'static Opened<K, T>,
    key: K,
    is_intact: impl Fn(&T) -> bool + Send,
    open: impl Fn(&K) -> Result<T> + Sync,
) -> PyResult<Arc<T>> {
    let find = || -> Option<Arc<T>> {
        let all = all.lock().unwrap_or_else(PoisonError::into_inner);
        all.iter().find(|(known, one)| *known == key && is_intact(one)).map(|(_, one)| one.clone())
    };
    if let Some(known) = find() {
        return Ok(known);
    }
    let _quiet = QuietWayland::begin(py)?;
    detached(py, || {
        let opened = Arc::new(open(&key)?);
        let mut all = all.lock().map_err(|_| Error::internal("a thread panicked"))?;
        all.retain(|(known, _)| *known != key);
        all.push((key.clone(), opened.clone()));
        Ok(opened)
    })
}

/// Gives the Wayland library a folder to look for a display in until it is dropped, so that it prints no error.
struct QuietWayland<'py>(Option<Bound<'py, PyAny>>);

impl<'py> QuietWayland<'py> {
    fn begin(py: Python<'py>) -> PyResult<Self> {
        let environment = py.import("os")?.getattr("environ")?;
        if cfg!(not(target_os = "linux")) || environment.contains(WAYLAND_VARIABLE)? {
            return Ok(QuietWayland(None));
        }
        environment.set_item(WAYLAND_VARIABLE, std::env::temp_dir().as_os_str())?;
        Ok(QuietWayland(Some(environment)))
    }
}

impl Drop for QuietWayland<'_> {
    fn drop(&mut self) {
        if let Some(environment) = &self.0 {
            // Another thread may have removed it.
            let _ = environment.del_item(WAYLAND_VARIABLE);
        }
    }
}
