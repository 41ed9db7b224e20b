//! The fields of a NRRD header: lines of `field: value`.

use std::collections::BTreeMap;
use std::io::BufRead;

use crate::volume::text::{HeaderLines, exactly, shortened};

/// The fields of a header by name, in lower case and with the spaces of the definition, and the lines of a list of files.
pub(super) struct NrrdFields {
    by_name: BTreeMap<String, String>,
    pub(super) files: Vec<String>,
}

impl NrrdFields {
    /// Reads the fields, and leaves `reader` after the blank line.
    ///
    /// # Errors
    ///
    /// A description without the name of the file.
    pub(super) fn read(reader: &mut impl BufRead) -> Result<Self, String> {
        let mut lines = HeaderLines::new(reader);
        let magic = lines.next()?.unwrap_or_default();
        if !matches!(magic.strip_prefix("NRRD000").map(str::as_bytes), Some([b'1'..=b'5'])) {
            return Err("not a NRRD file: the first line is not NRRD0001 to NRRD0005".to_owned());
        }
        let mut fields = BTreeMap::new();
        while let Some(line) = lines.next()?.filter(|line| !line.is_empty()) {
            if line.starts_with('#') {
                continue;
            }
            let Some((name, value)) = line.split_once(':') else {
                return Err(format!("header line '{}', expected 'field: value'", shortened(&line)));
            };
            if value.starts_with('=') {
                continue;
            }
            let name = match name.trim().to_ascii_lowercase().as_str() {
                "datafile" => "data file".to_owned(),
                "lineskip" => "line skip".to_owned(),
                "byteskip" => "byte skip".to_owned(),
                "axismins" => "axis mins".to_owned(),
                "axismaxs" => "axis maxs".to_owned(),
                "centerings" => "centers".to_owned(),
                other => other.to_owned(),
            };
            let is_list = name == "data file" && is_list(value.trim());
            if fields.insert(name.clone(), value.trim().to_owned()).is_some() {
                return Err(format!("field '{}' appears twice", shortened(&name)));
            }
            // The list ends the header.
            if is_list {
                let mut files = Vec::new();
                while let Some(file) = lines.next()?.filter(|file| !file.is_empty()) {
                    files.push(file);
                }
                return Ok(NrrdFields { by_name: fields, files });
            }
        }
        Ok(NrrdFields { by_name: fields, files: Vec::new() })
    }

    /// The value of a field.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.by_name.get(name).map(String::as_str)
    }

    /// The number in a field.
    pub(super) fn number<T: std::str::FromStr>(&self, name: &str) -> Result<Option<T>, String> {
        self.get(name)
            .map(|text| {
                text.parse().map_err(|_| {
                    format!("'{name}' is '{}', expected a whole number in range", shortened(text))
                })
            })
            .transpose()
    }

    /// Replaces the value of a field, if the header has it.
    pub(super) fn replace(&mut self, name: &str, change: impl FnOnce(&str) -> String) {
        if let Some(text) = self.by_name.get_mut(name) {
            *text = change(text);
        }
    }

    /// Three values separated by spaces.
    pub(super) fn three<T: std::str::FromStr>(&self, name: &str) -> Result<Option<[T; 3]>, String> {
        let Some(text) = self.get(name) else { return Ok(None) };
        let three = exactly(text).map(Some);
        three.ok_or_else(|| format!("'{name}' is '{}', expected 3 numbers", shortened(text)))
    }
}

/// Whether a list of data files follows: `LIST`, or `LIST 2`.
fn is_list(value: &str) -> bool {
    value == "LIST" || value.starts_with("LIST ")
}
