//! Selects the volume in a file that has several: a frame in time, a channel, an array by name.

use std::io;

use super::data_error::invalid;
use super::text::shortened;

/// The chosen one of `n` frames (or channels), or the only one.
///
/// # Errors
///
/// `InvalidData` with the flag if one of several must be chosen, and with the range if the number is too large.
pub(crate) fn one_of(what: &str, given: Option<usize>, n: usize) -> io::Result<usize> {
    match given {
        None if n == 1 => Ok(0),
        Some(i) if i < n => Ok(i),
        _ if n == 0 => Err(invalid(format!("no {what}s, expected at least one"))),
        Some(i) => Err(invalid(format!("no {what} {i}, expected --{what} 0 to {}", n - 1))),
        None => {
            Err(invalid(format!("{n} {what}s, expected one chosen by --{what} 0 to {}", n - 1)))
        }
    }
}

/// The index of the array of the given name; without a name that of the active or the only one.
///
/// # Errors
///
/// `InvalidData` with the names of the arrays.
pub(crate) fn by_name(
    names: &[&str],
    given: Option<&str>,
    active: Option<&str>,
) -> io::Result<usize> {
    let find = |wanted: &str| names.iter().position(|&name| name == wanted);
    let shown = || {
        let some: Vec<String> = names.iter().take(8).map(|name| shortened(name)).collect();
        some.join(", ")
    };
    match given {
        Some(wanted) => find(wanted).ok_or_else(|| {
            invalid(format!("no array '{}', expected one of {}", shortened(wanted), shown()))
        }),
        None if names.len() == 1 => Ok(0),
        None => active.and_then(find).ok_or_else(|| {
            invalid(format!("{} arrays, expected --array with one of {}", names.len(), shown()))
        }),
    }
}
