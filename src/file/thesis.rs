//! The file layout of the thesis (section 4.4).
//!
//! Everything is 32 bits wide and little endian: vertices with their trajectories (position,
//! normal, isovalue), triangles (smallest and largest isovalue, three vertices), edge collapses
//! (pairs of vertices). The layout has no volume, events, caps or isovalues of collapses;
//! the reader sets neutral values for these.
//!
//! # Collapses
//!
//! A triangle of the thesis names the vertices of its creation, and a vertex that does not exist
//! at an isovalue is looked up in the collapses (sections 4.2 and 4.3). A [`Spectrum`] needs
//! trajectories that last as long as their triangles, so such triangles are split into pieces, each with
//! the replacement vertices for that part of its life. The triangles of a [`Spectrum`] are written and read
//! unchanged.

use std::path::Path;

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input;
use crate::spectrum::{
    About, Collapse, Knot, Normals, Patch, Spectrum, Triangle, VolumeInfo, normal,
};
use crate::volume::{Outside, Placement};

/// Writes a spectrum in the layout of the thesis: to a temporary file in the same folder, which is then renamed.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if the spectrum does not pass [`Spectrum::check`].
pub fn write(spectrum: &Spectrum, path: impl AsRef<Path>) -> Result<()> {
    let bytes = to_bytes(spectrum)?;
    write_atomically(path.as_ref(), |writer| writer.write_all(&bytes))
}

/// Reads a file in the layout of the thesis. It may be from an untrusted source.
///
/// # Errors
///
/// [`Error::Io`]; [`Error::Input`] if it is damaged, with the path.
pub fn read(path: impl AsRef<Path>) -> Result<Spectrum> {
    let path = path.as_ref();
    from_bytes(&input::read(path)?).map_err(|e| e.of_file(path))
}

/// The bytes of a spectrum in the layout of the thesis. Isovalues are rounded to f32.
///
/// # Errors
///
/// [`Error::Input`] if the spectrum does not pass [`Spectrum::check`], or an isovalue is outside the range of f32.
pub fn to_bytes(spectrum: &Spectrum) -> Result<Vec<u8>> {
    spectrum.check()?;
    if let Some(c) = spectrum.isovalues().iter().find(|&&c| !(c as f32).is_finite()) {
        return Err(Error::input(format!(
            "isovalue {c:e}, expected at most {:e}: the layout of the thesis has 32-bit floats",
            f32::MAX
        )));
    }
    let isovalue = |rank: u32| spectrum.isovalues()[rank as usize] as f32;
    let normals = Normals::of(spectrum);
    let mut codes = normals.codes().iter();
    let mut file = Vec::new();
    file.extend((spectrum.n_vertices() as u32).to_le_bytes());
    for v in 0..spectrum.n_vertices() as u32 {
        let trajectory = spectrum.trajectory(v);
        file.extend((trajectory.len() as u32).to_le_bytes());
        for (knot, &code) in trajectory.iter().zip(&mut codes) {
            let row = knot.position.into_iter().chain(normal::decode(code));
            row.chain([isovalue(knot.rank)]).for_each(|x| file.extend(x.to_le_bytes()));
        }
    }
    file.extend((spectrum.triangles().len() as u32).to_le_bytes());
    for triangle in spectrum.triangles() {
        file.extend(isovalue(triangle.birth).to_le_bytes());
        file.extend(isovalue(triangle.death).to_le_bytes());
        triangle.vertices.iter().for_each(|v| file.extend(v.to_le_bytes()));
    }
    file.extend((spectrum.collapses().len() as u32).to_le_bytes());
    for collapse in spectrum.collapses() {
        file.extend(collapse.vertex.to_le_bytes());
        file.extend(collapse.target.to_le_bytes());
    }
    Ok(file)
}

/// The spectrum in bytes of the layout of the thesis.
///
/// Of several knots at one isovalue the last counts, and triangles with an empty lifetime are skipped (section 4.1). A triangle is skipped
/// while one of its vertices has neither a position nor a replacement.
///
/// # Errors
///
/// [`Error::Input`] if the bytes end early or go on, a number is not finite, isovalues decrease, or
/// a vertex does not exist.
pub fn from_bytes(bytes: &[u8]) -> Result<Spectrum> {
    let file = Layout::parse(bytes)?;
    let (first_knot, knots) = trajectories(&file)?;
    let isovalues: Vec<f64> = file.isovalues.iter().map(|&c| c.into()).collect();
    let range = (
        isovalues.first().copied().unwrap_or_default(),
        isovalues.last().copied().unwrap_or_default(),
    );
    let info = VolumeInfo {
        name: String::new(),
        dims: [0; 3],
        sample_type: String::new(),
        range,
        placement: Placement::default(),
        outside: Outside::Low,
    };
    let patch = Patch { isovalues, first_knot, knots, ..Patch::default() };
    let moved = Spectrum::unchecked(About::new(info, range, 0.0), patch);
    let triangles = Pieces::new(&moved, &file)?.cut(&file)?;
    let collapses = collapses(&moved, &file.collapses);
    let (about, patch) = moved.into_parts();
    Spectrum::new(about, Patch { triangles, collapses, ..patch })
}

/// The content of a file, with its table of isovalues.
#[derive(Debug, Default)]
struct Layout {
    /// By vertex, its knots: position, normal, isovalue.
    vertices: Vec<Vec<[f32; 7]>>,
    /// Lifetimes and vertices.
    triangles: Vec<([f32; 2], [u32; 3])>,
    collapses: Vec<[u32; 2]>,
    /// All isovalues, increasing.
    isovalues: Vec<f32>,
}

impl Layout {
    fn parse(bytes: &[u8]) -> Result<Self> {
        let mut rest = Rest(bytes);
        let mut file = Layout::default();
        for v in 0..rest.count(4, "vertices")? {
            let n = rest.count(28, "knots")?;
            let row = |rest: &mut Rest<'_>| rest.numbers(&format!("vertex {v}"));
            file.vertices.push((0..n).map(|_| row(&mut rest)).collect::<Result<_>>()?);
        }
        for i in 0..rest.count(20, "triangles")? {
            let lifetime = rest.numbers(&format!("triangle {i}"))?;
            file.triangles.push((lifetime, [rest.integer()?, rest.integer()?, rest.integer()?]));
        }
        for _ in 0..rest.count(8, "collapses")? {
            file.collapses.push([rest.integer()?, rest.integer()?]);
        }
        if !rest.0.is_empty() {
            return Err(Error::input(format!("{} bytes after the collapses", rest.0.len())));
        }
        let knots = file.vertices.iter().flatten().map(|row| row[6]);
        let ends = file.triangles.iter().flat_map(|(lifetime, _)| *lifetime);
        // Minus zero is zero.
        file.isovalues = knots.chain(ends).map(|c| c + 0.0).collect();
        file.isovalues.sort_unstable_by(f32::total_cmp);
        file.isovalues.dedup();
        Ok(file)
    }

    fn rank(&self, isovalue: f32) -> u32 {
        self.isovalues.partition_point(|&c| c < isovalue) as u32
    }
}

/// The unread rest of a file.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn integer(&mut self) -> Result<u32> {
        let (taken, rest) = self.0.split_first_chunk().ok_or_else(|| {
            Error::input(format!("the file ends {} bytes into a number", self.0.len()))
        })?;
        self.0 = rest;
        Ok(u32::from_le_bytes(*taken))
    }

    /// A count of elements of at least `size` bytes each, for which the file must have enough bytes.
    fn count(&mut self, size: u64, of: &str) -> Result<u32> {
        let count = self.integer()?;
        if u64::from(count) * size > self.0.len() as u64 {
            return Err(Error::input(format!(
                "{count} {of}, expected no more than the {} bytes left can hold",
                self.0.len()
            )));
        }
        Ok(count)
    }

    fn numbers<const N: usize>(&mut self, of: &str) -> Result<[f32; N]> {
        let mut numbers = [0.0; N];
        for x in &mut numbers {
            *x = f32::from_bits(self.integer()?);
            if !x.is_finite() {
                return Err(Error::input(format!(
                    "{of} has the number {x}, expected a finite one"
                )));
            }
        }
        Ok(numbers)
    }
}

fn trajectories(file: &Layout) -> Result<(Vec<u32>, Vec<Knot>)> {
    let (mut first_knot, mut knots) = (vec![0], Vec::<Knot>::new());
    for (v, rows) in file.vertices.iter().enumerate() {
        let start = knots.len();
        for &[x, y, z, _, _, _, c] in rows {
            let rank = file.rank(c);
            let last = knots[start..].last().map(|knot| knot.rank);
            if last > Some(rank) {
                return Err(Error::input(format!(
                    "vertex {v} goes back to isovalue {c}, expected increasing isovalues"
                )));
            }
            if last == Some(rank) {
                knots.pop();
            }
            knots.push(Knot { rank, position: [x, y, z] });
        }
        first_knot.push(knots.len() as u32);
    }
    Ok((first_knot, knots))
}

/// Splits triangles where their vertices end.
struct Pieces {
    /// First and last rank of each vertex; empty (1, 0) where it has no knots.
    spans: Vec<(u32, u32)>,
    /// By vertex, its replacement: the array `edgeCollapse` of section 4.4.
    replacement: Vec<Option<u32>>,
    /// Remaining look-ups; limits cycles of collapses.
    budget: usize,
}

impl Pieces {
    fn new(spectrum: &Spectrum, file: &Layout) -> Result<Self> {
        let n = spectrum.n_vertices() as u32;
        let spans = (0..n).map(|v| match spectrum.trajectory(v) {
            [] => (1, 0),
            [first, .., last] => (first.rank, last.rank),
            [only] => (only.rank, only.rank),
        });
        let mut replacement = vec![None; n as usize];
        for (i, &[vertex, target]) in file.collapses.iter().enumerate() {
            if vertex >= n || target >= n || vertex == target {
                return Err(Error::input(format!(
                    "collapse {i}: vertex {vertex} onto {target}, expected two different vertices below {n}"
                )));
            }
            replacement[vertex as usize] = Some(target);
        }
        Ok(Pieces {
            spans: spans.collect(),
            replacement,
            budget: 4096 + 64 * (file.triangles.len() + file.collapses.len()),
        })
    }

    fn cut(mut self, file: &Layout) -> Result<Vec<Triangle>> {
        let mut pieces = Vec::with_capacity(file.triangles.len());
        for (i, &([low, high], vertices)) in file.triangles.iter().enumerate() {
            let n = self.spans.len();
            if low > high || vertices.iter().any(|&v| v as usize >= n) {
                return Err(Error::input(format!(
                    "triangle {i}: isovalues {low} to {high}, vertices {vertices:?}, expected an interval and vertices below {n}"
                )));
            }
            self.cut_one(vertices, file.rank(low), file.rank(high), &mut pieces)?;
        }
        Ok(pieces)
    }

    /// Appends the pieces of a triangle that is alive from `birth` to `death`.
    fn cut_one(
        &mut self,
        vertices: [u32; 3],
        birth: u32,
        death: u32,
        pieces: &mut Vec<Triangle>,
    ) -> Result<()> {
        let mut rank = birth;
        while rank < death {
            let mut present = [None; 3];
            for (present, v) in present.iter_mut().zip(vertices) {
                *present = self.resolve(v, rank)?;
            }
            if let [Some(a), Some(b), Some(c)] = present {
                let end = [a, b, c].iter().fold(death, |end, &v| end.min(self.spans[v as usize].1));
                if a != b && b != c && c != a {
                    let vertices = [a, b, c];
                    pieces.push(Triangle { vertices, birth: rank, death: end, cap: false });
                }
                rank = end;
            } else {
                let later = vertices.iter().map(|&v| self.spans[v as usize].0);
                match later.filter(|&first| first > rank).min() {
                    Some(first) => rank = first,
                    None => return Ok(()),
                }
            }
        }
        Ok(())
    }

    /// The vertex that replaces `v` from `rank` to at least the next rank; `v` itself if it exists there.
    fn resolve(&mut self, v: u32, rank: u32) -> Result<Option<u32>> {
        let mut v = v;
        loop {
            self.budget = self.budget.checked_sub(1).ok_or_else(|| {
                Error::input("collapses replace vertices without end, expected chains")
            })?;
            let (first, last) = self.spans[v as usize];
            if first <= rank && rank < last {
                return Ok(Some(v));
            }
            match self.replacement[v as usize] {
                Some(target) => v = target,
                None => return Ok(None),
            }
        }
    }
}

/// The collapses, with rank and direction from the trajectories: at the last rank of the vertex
/// that ends if its target exists there, else at its first rank if the target exists there.
fn collapses(spectrum: &Spectrum, pairs: &[[u32; 2]]) -> Vec<Collapse> {
    let span = |v: u32| {
        let trajectory = spectrum.trajectory(v);
        trajectory.first().zip(trajectory.last()).map(|(first, last)| (first.rank, last.rank))
    };
    let known = pairs.iter().filter_map(|&[vertex, target]| {
        // Collapses of vertices without knots are dropped.
        let ((first, last), target_span) = (span(vertex)?, span(target));
        let meets = |rank: u32| target_span.is_some_and(|(a, b)| a <= rank && rank <= b);
        let upward = meets(last) || !meets(first);
        Some(Collapse { vertex, target, rank: if upward { last } else { first }, upward })
    });
    known.collect()
}
