//! A spectrum as a folder of parts, `.ispt`: each a file of its own, read only where it is needed.
//!
//! # Layout
//!
//! `index.json` ([`Index`]); `whole.isp`, a spectrum file without triangles, which has the events and all that is known of the
//! whole; of each part that has triangles a spectrum file, `000000.isp`, and its vertices in common with other parts, `000000.seam`:
//! `ISPTSEAM`, how many (u32), their numbers in the part (u32, ascending), their keys (u64), the CRC-32 of all before. Numbers are
//! little endian.
//!
//! # Invariants
//!
//! Vertices of one key are one vertex, with the same trajectory in every part. Every part names the plan that it is of, and its number.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::from_bytes;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{About, Joiner, Patch, Spectrum, SpectrumBuilder};

/// The file that tells what is in the folder.
pub const INDEX: &str = "index.json";

/// The file of what is known of the whole.
pub const WHOLE: &str = "whole.isp";

/// The version of such folders.
const VERSION: u32 = 1;

const SEAM_MAGIC: [u8; 8] = *b"ISPTSEAM";

/// Under this name the parameters of a part's file tell which part it is ([`PartName`]).
pub(crate) const PART: &str = "part";

/// Which part a file is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PartName {
    /// The hash of its plan.
    pub(crate) plan: String,
    /// Its number.
    pub(crate) number: usize,
}

/// What is in a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Index {
    /// Version of the folder.
    version: u32,
    /// Hash of the plan that the parts are of.
    pub plan: String,
    /// Trajectories, knots and triangles of the whole; what parts have in common is counted once.
    pub size: [u64; 3],
    /// All parts, those without triangles too.
    pub parts: Vec<IndexedPart>,
}

/// What is known of a part without it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct IndexedPart {
    /// Its first sample along x, y, z.
    pub first: [usize; 3],
    /// The sample behind its last one.
    pub end: [usize; 3],
    /// Trajectories, knots and triangles in its file.
    pub size: [u64; 3],
    /// The lowest isovalue at which it has triangles, and the one from which it has none; none where there is no file.
    pub lives: Option<(f64, f64)>,
    /// How many events lie in it.
    pub events: usize,
    /// Bytes of its files.
    pub bytes: u64,
}

impl Index {
    /// What is in a folder of this version.
    pub(crate) fn new(plan: &str, size: [u64; 3], parts: Vec<IndexedPart>) -> Index {
        Index { version: VERSION, plan: plan.to_owned(), size, parts }
    }
}

/// The name of a part's spectrum file.
pub(crate) fn part_name(number: usize) -> String {
    format!("{number:06}.isp")
}

/// The name of the file of a part's vertices in common with others.
pub(crate) fn seam_name(number: usize) -> String {
    format!("{number:06}.seam")
}

/// The bytes of the file of vertices in common, each with its key.
pub(crate) fn seam_bytes(shared: &[(u32, u64)]) -> Vec<u8> {
    let mut bytes = SEAM_MAGIC.to_vec();
    bytes.extend((shared.len() as u32).to_le_bytes());
    bytes.extend(shared.iter().flat_map(|s| s.0.to_le_bytes()));
    bytes.extend(shared.iter().flat_map(|s| s.1.to_le_bytes()));
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// Vertices in common from their file.
fn read_seam(bytes: &[u8]) -> Result<Vec<(u32, u64)>> {
    let damaged = || Error::input("damaged vertices in common with other parts");
    let (content, crc) = bytes.split_last_chunk::<4>().ok_or_else(damaged)?;
    if crc32fast::hash(content) != u32::from_le_bytes(*crc) {
        return Err(damaged());
    }
    let rest = content.strip_prefix(&SEAM_MAGIC).ok_or_else(damaged)?;
    let (n, rest) = rest.split_first_chunk::<4>().ok_or_else(damaged)?;
    let n = u32::from_le_bytes(*n) as usize;
    if rest.len() as u64 != 12 * n as u64 {
        return Err(damaged());
    }
    let (vertices, keys) = rest.split_at(4 * n);
    let vertices = vertices.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let key = |b: &[u8]| b.iter().rev().fold(0u64, |key, &byte| key << 8 | u64::from(byte));
    Ok(vertices.zip(keys.chunks_exact(8).map(key)).collect())
}

/// Whether a path is that of a folder of parts.
pub fn is_folder(path: &Path) -> bool {
    path.join(INDEX).is_file()
}

/// A folder of parts, of which no part is read yet.
#[derive(Clone, Debug)]
pub struct SpectrumFolder {
    path: PathBuf,
    index: Index,
    whole: Spectrum,
    bytes: u64,
}

impl SpectrumFolder {
    /// Reads what is known of the whole.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Input`] if there is no folder of this version, or it is damaged.
    pub fn open(path: &Path) -> Result<SpectrumFolder> {
        let file = path.join(INDEX);
        let bytes = input::read(&file)?;
        let no_index = |what: String| {
            Error::input(format!("{}: no index of this version: {what}", file.display()))
        };
        let index: Index = serde_json::from_slice(&bytes).map_err(|e| no_index(e.to_string()))?;
        if index.version != VERSION {
            return Err(no_index(format!("version {}, expected {VERSION}", index.version)));
        }
        let is_life = |l: &(f64, f64)| l.0 < l.1;
        if !index.parts.iter().filter_map(|p| p.lives.as_ref()).all(is_life) {
            return Err(no_index("a part that lives nowhere".to_owned()));
        }
        let whole = super::read(path.join(WHOLE))?;
        let of_whole = input::open(&path.join(WHOLE))?.1;
        let parts = index.parts.iter().fold(0u64, |n, p| n.saturating_add(p.bytes));
        let bytes = parts.saturating_add(bytes.len() as u64).saturating_add(of_whole);
        Ok(SpectrumFolder { path: path.to_owned(), index, whole, bytes })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What is in it.
    pub fn index(&self) -> &Index {
        &self.index
    }

    /// Bytes of all its files, as the index says.
    pub fn n_bytes(&self) -> u64 {
        self.bytes
    }

    /// What is known of the whole: a spectrum without triangles.
    pub fn whole(&self) -> &Spectrum {
        &self.whole
    }

    /// The numbers of the parts that have triangles somewhere between two isovalues, both included.
    pub fn parts_between(&self, (low, high): (f64, f64)) -> impl Iterator<Item = usize> + '_ {
        let lives = move |p: &IndexedPart| p.lives.is_some_and(|(b, d)| b <= high && low < d);
        self.index.parts.iter().enumerate().filter(move |(_, p)| lives(p)).map(|(i, _)| i)
    }

    /// The spectrum between two isovalues of its range, both included: its meshes there are those of the whole. Parts that do not
    /// live there are not read, triangles that do not are not kept; no more than one part is in memory beside these.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside the whole's range; [`Error::Io`]; [`Error::Input`] for damaged parts and those that do not fit.
    pub fn read_between(&self, between: (f64, f64)) -> Result<Spectrum> {
        [between.0, between.1].into_iter().try_for_each(|c| self.whole.check_isovalue(c))?;
        let mut joiner = Joiner::default();
        for number in self.parts_between(between) {
            let (patch, shared) = living(self.part(number)?, between);
            self.append(&mut joiner, number, (&patch, &shared))?;
        }
        self.spectrum(joiner.finish().0, between)
    }

    /// The whole spectrum.
    ///
    /// # Errors
    ///
    /// As [`SpectrumFolder::read_between`].
    pub fn read(&self) -> Result<Spectrum> {
        self.read_between(self.whole.range())
    }

    /// A spectrum of parts of this one, with its events.
    pub(super) fn spectrum(&self, patch: Patch, range: (f64, f64)) -> Result<Spectrum> {
        let mut builder = SpectrumBuilder::new();
        builder.push_patch(patch);
        builder.finish(About { range, ..self.whole.about().clone() })
    }

    /// Takes a part in.
    pub(super) fn append(
        &self,
        joiner: &mut Joiner,
        number: usize,
        (patch, shared): (&Patch, &[(u32, u64)]),
    ) -> Result<()> {
        joiner.append(patch, shared)?.map_err(|at| {
            let file = self.path.join(part_name(number));
            Error::input(format!(
                "{}: another vertex at {:?} than the part beside it, expected parts of one volume",
                file.display(),
                at.0
            ))
        })
    }

    /// A part, and its vertices in common with others, ascending, with their keys.
    pub(super) fn part(&self, number: usize) -> Result<(Patch, Vec<(u32, u64)>)> {
        let file = self.path.join(part_name(number));
        let part = from_bytes(&input::read(&file)?).map_err(|e| e.of_file(&file))?;
        let expected = PartName { plan: self.index.plan.clone(), number };
        let name = part.parameters().get(PART).map(PartName::deserialize);
        if !name.is_some_and(|name| name.is_ok_and(|name| name == expected)) {
            let PartName { plan, .. } = expected;
            return Err(Error::input(format!(
                "{}: expected part {number} of plan {plan}",
                file.display()
            )));
        }
        let seam = self.path.join(seam_name(number));
        let shared = read_seam(&input::read(&seam)?).map_err(|e| e.of_file(&seam))?;
        let ascends = shared.windows(2).all(|w| w[0].0 < w[1].0);
        if !ascends || shared.last().is_some_and(|s| s.0 as usize >= part.n_vertices()) {
            return Err(Error::input(format!("{}: of another part", seam.display())));
        }
        Ok((part.into_parts().1, shared))
    }
}

/// What of a part lives somewhere between two isovalues, both included.
fn living(
    (part, shared): (Patch, Vec<(u32, u64)>),
    (low, high): (f64, f64),
) -> (Patch, Vec<(u32, u64)>) {
    // The first rank above the low end, and above the high one.
    let above = |x: f64| part.isovalues.partition_point(|&c| c <= x) as u32;
    let (first, last) = (above(low), above(high));
    let lives = |t: &crate::spectrum::Triangle| t.birth < last && t.death >= first;
    let Patch { isovalues, first_knot, knots, mut triangles, .. } = part;
    triangles.retain(lives);
    let mut is_used = vec![false; first_knot.len().saturating_sub(1)];
    triangles.iter().flat_map(|t| t.vertices).for_each(|v| is_used[v as usize] = true);
    let mut number = vec![u32::MAX; is_used.len()];
    let mut kept = Patch { isovalues, first_knot: vec![0], ..Patch::default() };
    for v in (0..is_used.len()).filter(|&v| is_used[v]) {
        number[v] = kept.first_knot.len() as u32 - 1;
        kept.knots.extend(&knots[first_knot[v] as usize..first_knot[v + 1] as usize]);
        kept.first_knot.push(kept.knots.len() as u32);
    }
    triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(|v| number[v as usize]));
    kept.triangles = triangles;
    let shared = shared.into_iter().filter(|s| is_used[s.0 as usize]);
    let shared = shared.map(|(v, key)| (number[v as usize], key)).collect();
    (kept, shared)
}
