//! The memory that the system grants the program, as far as it can be read: on Linux.
//!
//! A program that needs more is killed by the allocator or the kernel, possibly after hours. So the forecast is compared with
//! this limit before the work begins.

use std::fs::read_to_string;
use std::path::Path;

/// A limit of memory and its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Allowed {
    pub(super) bytes: f64,
    pub(super) by: &'static str,
    /// True if allocations beyond it fail; otherwise the kernel makes room or ends a process.
    pub(super) is_strict: bool,
}

/// Address space that blocks of memory take with the gaps between them, per byte (measured: up to 1.3).
const GAPS: f64 = 1.3;

/// The limit of address space in the files of the kernel: its name, the part in use, and the name for people.
const ADDRESS_SPACE: (&str, &str, &str) =
    ("Max address space", "VmSize:", "the limit of address space (ulimit -v)");

/// As [`ADDRESS_SPACE`], of data.
const DATA: (&str, &str, &str) = ("Max data size", "VmData:", "the limit of data (ulimit -d)");

/// Returns the lowest limit; none if none can be read.
pub(super) fn allowed() -> Option<Allowed> {
    let read = |path: &str| read_to_string(path).unwrap_or_default();
    let of_group = group_limit(&read("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
    let lenient = |by| move |bytes| Allowed { bytes, by, is_strict: false };
    let of_group = of_group.map(lenient("the limit of the control group"));
    let free = kib(&read("/proc/meminfo"), "MemAvailable:").map(lenient("the free memory"));
    let all = allowed_by_process().into_iter().chain(of_group).chain(free);
    all.min_by(|a, b| a.bytes.total_cmp(&b.bytes))
}

/// Returns the lower limit of the process, beyond which allocations fail; none if there is none.
pub(super) fn allowed_by_process() -> Option<Allowed> {
    let all = [ADDRESS_SPACE, DATA].into_iter().filter_map(left_of);
    all.min_by(|a, b| a.bytes.total_cmp(&b.bytes))
}

/// Returns the bytes of address space that are left, less gaps; none if they are not limited.
pub(super) fn address_space() -> Option<f64> {
    left_of(ADDRESS_SPACE).map(|left| left.bytes)
}

fn left_of((limit, used, by): (&str, &str, &'static str)) -> Option<Allowed> {
    let read = |path: &str| read_to_string(path).unwrap_or_default();
    let limit = soft_limit(&read("/proc/self/limits"), limit)?;
    let left = limit - kib(&read("/proc/self/status"), used).unwrap_or(0.0);
    Some(Allowed { bytes: left.max(0.0) / GAPS, by, is_strict: true })
}

/// Parses a row of `/proc/self/limits`; none if unlimited.
fn soft_limit(limits: &str, name: &str) -> Option<f64> {
    let row = limits.lines().find_map(|line| line.strip_prefix(name))?;
    row.split_whitespace().next()?.parse().ok()
}

/// Parses a row such as `MemAvailable:  123 kB` to bytes.
fn kib(rows: &str, name: &str) -> Option<f64> {
    let row = rows.lines().find_map(|line| line.strip_prefix(name))?;
    row.split_whitespace().next()?.parse::<f64>().ok().map(|kib| 1024.0 * kib)
}

/// Returns the lowest limit of the control group and its ancestors, of either version.
fn group_limit(groups: &str, root: &Path) -> Option<f64> {
    let limits = groups.lines().flat_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (kind, path) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        let (folder, file) = match kind {
            "" => (root.to_path_buf(), "memory.max"),
            kind if kind.split(',').any(|k| k == "memory") => {
                (root.join("memory"), "memory.limit_in_bytes")
            }
            _ => return Vec::new(),
        };
        let path = Path::new(path.trim_start_matches('/'));
        // The last of `ancestors` is the empty path: the root.
        let limit = |part: &Path| read_to_string(folder.join(part).join(file)).ok();
        path.ancestors().filter_map(limit).filter_map(|text| text.trim().parse().ok()).collect()
    });
    limits.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_parsed_from_the_files_of_linux() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units\n\
            Max data size             unlimited            unlimited            bytes\n\
            Max address space         2048000              unlimited            bytes\n";
        assert_eq!(soft_limit(limits, "Max address space"), Some(2_048_000.0));
        assert_eq!(soft_limit(limits, "Max data size"), None);
        assert_eq!(kib("MemFree:  7 kB\nMemAvailable:    24 kB\n", "MemAvailable:"), Some(24576.0));
        assert_eq!(kib("", "MemAvailable:"), None);
    }

    #[test]
    fn a_group_has_the_lowest_limit_of_its_ancestors() {
        let root = tempfile::tempdir().expect("a folder");
        let write = |path: &str, text: &str| {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, text).expect("written");
        };
        write("a/memory.max", "5000\n");
        write("a/b/memory.max", "max\n");
        write("memory/c/memory.limit_in_bytes", "4000\n");
        assert_eq!(group_limit("0::/a/b\n", root.path()), Some(5000.0));
        assert_eq!(group_limit("7:cpu:/c\n4:memory,x:/c\n0::/a/b\n", root.path()), Some(4000.0));
        assert_eq!(group_limit("0::/other\n", root.path()), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_machine_has_some_memory() {
        assert!(allowed().is_some_and(|allowed| allowed.bytes > 0.0));
    }
}
