//! Errors of usage in the form of all other errors: one line, exit code 2.

use std::ffi::OsString;
use std::io::{self, Write as _};

use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::{exit_code, terminal};

/// Names that other programs use, and our flag. The first flag that the command has is suggested.
const OTHER_NAMES: [(&[&str], &[&str]); 22] = [
    (&["tolerance", "tol", "accuracy", "max-error", "precision", "deviation"], &["error"]),
    (
        &["isovalue", "iso", "isolevel", "level", "value", "threshold", "contour", "isosurface"],
        &["isovalue", "range", "start"],
    ),
    (&["isovalues", "levels", "values", "isorange", "from", "to"], &["sweep", "range"]),
    (&["min-isovalue", "max-isovalue", "min", "max"], &["range"]),
    (&["out", "output-file", "outfile", "output-dir", "dir", "save", "write"], &["output"]),
    (&["gpu", "cpu", "device", "cuda", "vulkan"], &["backend", "adapter"]),
    (&["jobs", "num-threads", "nthreads", "n-threads", "cores", "workers"], &["threads"]),
    (&["memory", "mem", "ram", "memory-limit", "max-mem"], &["max-memory"]),
    (&["max-faces", "faces", "target-faces", "triangles"], &["max-triangles"]),
    (&["roi", "region", "box", "extent", "subvolume", "bounds"], &["crop", "clip"]),
    (&["gaussian", "blur", "sigma", "smoothing"], &["smooth"]),
    (&["denoise", "simplify", "noise"], &["persistence", "median"]),
    (&["shrink", "subsample", "resample", "coarsen", "stride"], &["downsample"]),
    (&["min-size", "min-voxels", "remove-small", "islands"], &["min-component", "min-volume"]),
    (&["largest", "keep-largest", "biggest"], &["keep"]),
    (&["shape", "dimensions", "size", "resolution"], &["dims", "size"]),
    (&["dtype", "datatype", "data-type", "pixel-type"], &["type"]),
    (&["byte-order", "endianness", "big-endian", "little-endian"], &["endian"]),
    (&["voxel-size", "pixel-size", "voxelsize", "scale"], &["spacing"]),
    (&["width", "height", "image-size", "window-size"], &["size"]),
    (&["colour", "colors", "colormap", "cmap", "palette"], &["color", "color-map"]),
    (&["timestep", "time", "time-step", "volume-index"], &["frame"]),
];

/// Prints the help or the version if requested, otherwise the error on one line. Returns the exit code.
pub(super) fn report(
    error: &clap::Error,
    definition: &clap::Command,
    arguments: &[OsString],
) -> u8 {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let printed = error.print().and_then(|()| io::stdout().flush());
            match printed {
                // A closed pipe is no error: its reader has enough.
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                    terminal::print_message(&format!("standard output: {error}"));
                    exit_code::FILE
                }
                _ => exit_code::SUCCESS,
            }
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            exit_code::USAGE
        }
        _ => {
            let suggestion = other_name(error, definition, arguments.iter().cloned())
                .or_else(|| similar_name(error))
                .map_or_else(String::new, |name| format!(", did you mean '{name}'?"));
            let message = format!("{}{suggestion}", first_sentence(&error.to_string()));
            terminal::print_message(&format!("{} (see --help)", terminal::line(&message)));
            exit_code::USAGE
        }
    }
}

/// Returns the first paragraph of clap's text, the error; tips and usage follow it.
fn first_sentence(text: &str) -> String {
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    words.join(" ").trim_start_matches("error: ").to_owned()
}

/// Returns the flag for an unknown flag that has another name in other programs.
fn other_name(
    error: &clap::Error,
    definition: &clap::Command,
    arguments: impl Iterator<Item = OsString>,
) -> Option<String> {
    let ContextValue::String(unknown) = error.get(ContextKind::InvalidArg)? else { return None };
    let unknown = unknown.strip_prefix("--")?;
    let mut arguments = arguments.skip(1);
    let command = arguments.find_map(|word| definition.find_subcommand(&word))?;
    let (_, flags) = OTHER_NAMES.iter().find(|(names, _)| names.contains(&unknown))?;
    let has_flag = |flag: &&&str| command.get_arguments().any(|arg| arg.get_long() == Some(flag));
    flags.iter().find(has_flag).map(|flag| format!("--{flag}"))
}

/// Returns the command, flag or value that clap found to be spelled similarly.
fn similar_name(error: &clap::Error) -> Option<String> {
    let kinds =
        [ContextKind::SuggestedSubcommand, ContextKind::SuggestedArg, ContextKind::SuggestedValue];
    kinds.iter().find_map(|&kind| match error.get(kind)? {
        ContextValue::String(name) => Some(name.clone()),
        ContextValue::Strings(names) => names.last().cloned(),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_paragraph_becomes_one_line() {
        let text = "error: these were not provided:\n  --output <FILE>\n\nUsage: x\n";
        assert_eq!(first_sentence(text), "these were not provided: --output <FILE>");
    }

    #[test]
    fn other_names_lead_to_flags() {
        let definition = crate::cli::definition();
        let has_flag = |flag: &str| {
            let commands = definition.get_subcommands();
            commands.flat_map(clap::Command::get_arguments).any(|a| a.get_long() == Some(flag))
        };
        for flag in OTHER_NAMES.iter().flat_map(|(_, flags)| *flags) {
            assert!(has_flag(flag), "{flag}");
        }
        let suggestion = |line: &str| {
            let arguments = || line.split(' ').map(OsString::from);
            let error = definition.clone().try_get_matches_from(arguments()).expect_err(line);
            other_name(&error, &definition, arguments())
        };
        let compute = "isospectrum compute --phantom sphere:8 -o s.isp";
        for (wrong, flag) in [("--tolerance 0.1", "--error"), ("--iso 5", "--range")] {
            assert_eq!(suggestion(&format!("{compute} {wrong}")).as_deref(), Some(flag));
        }
        let render = "isospectrum -q render s.isp -o a.png --threshold 5";
        assert_eq!(suggestion(render).as_deref(), Some("--isovalue"));
        assert_eq!(suggestion(&format!("{compute} --strange 1")), None);
    }
}
