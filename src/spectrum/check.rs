//! Checks the invariants of a spectrum.

use super::data::Spectrum;
use super::elements::{Collapse, Triangle};
use crate::error::{Error, Result};

/// Largest absolute coordinate of a position, voxels. Far beyond any volume, and 2^30 quanta, so
/// that positions in the file fit 32 bits.
pub const MAX_COORDINATE: f32 = (1u32 << 20) as f32;

impl Spectrum {
    /// Checks that
    ///
    /// - range, tolerance, the volume's placement and all events are finite, events by isovalue;
    /// - isovalues are finite and strictly increasing;
    /// - `first_knot` starts at zero, never decreases and ends at the number of knots;
    /// - the ranks of a trajectory exist and increase strictly, and positions are finite and at
    ///   most [`MAX_COORDINATE`];
    /// - triangles have three different vertices that exist, live for at least one rank
    ///   (`birth < death`, both in the table), and every vertex has knots from birth to death;
    /// - collapses name two different vertices and a rank that exist.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] naming the first violation.
    pub fn check(&self) -> Result<()> {
        self.check_description()?;
        self.check_isovalues()?;
        self.check_trajectories()?;
        for (i, triangle) in self.triangles().iter().enumerate() {
            self.check_triangle(triangle)
                .map_err(|what| Error::input(format!("triangle {i}: {what}")))?;
        }
        check_collapses(self.collapses(), self.n_vertices() as u64, self.isovalues().len())
    }

    fn check_description(&self) -> Result<()> {
        let (low, high) = self.range();
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(Error::input(format!("range {low} to {high}, expected finite numbers")));
        }
        if !(self.tolerance().is_finite() && self.tolerance() >= 0.0) {
            return Err(Error::input(format!(
                "tolerance {}, expected a number of voxels",
                self.tolerance()
            )));
        }
        let placement = &self.volume().placement;
        let mut numbers = placement.origin.iter().chain(placement.direction.as_flattened());
        if !(self.volume().range.0.is_finite()
            && self.volume().range.1.is_finite()
            && numbers.all(|x| x.is_finite())
            && placement.spacing.iter().all(|&s| s.is_finite() && s > 0.0))
        {
            return Err(Error::input(
                "volume: range or placement is not finite, expected finite numbers and positive spacing",
            ));
        }
        for (i, event) in self.events().iter().enumerate() {
            if !event.isovalue.is_finite() || event.position.iter().any(|x| !x.is_finite()) {
                return Err(Error::input(format!("event {i} is not finite")));
            }
            if let Some(x) = event.position.iter().find(|x| x.abs() > MAX_COORDINATE.into()) {
                return Err(Error::input(format!(
                    "event {i} has the coordinate {x}, expected at most 2^20 voxels"
                )));
            }
            if let Some(p) = event.persistence.filter(|&p| !(p.is_finite() && p > 0.0)) {
                return Err(Error::input(format!(
                    "event {i} has the persistence {p}, expected a positive number"
                )));
            }
            if i > 0 && self.events()[i - 1].isovalue > event.isovalue {
                return Err(Error::input(format!("event {i} is below the one before it")));
            }
        }
        Ok(())
    }

    fn check_isovalues(&self) -> Result<()> {
        if u32::try_from(self.isovalues().len()).is_err() {
            return Err(Error::input("more than 2^32 isovalues"));
        }
        for (i, &c) in self.isovalues().iter().enumerate() {
            if !c.is_finite() || (i > 0 && self.isovalues()[i - 1] >= c) {
                return Err(Error::input(format!(
                    "isovalue {i} is {c}, expected finite numbers that increase"
                )));
            }
        }
        Ok(())
    }

    fn check_trajectories(&self) -> Result<()> {
        let (first, last) = (self.first_knot().first(), self.first_knot().last());
        let ends_with_knots = last.is_some_and(|&end| end as usize == self.knots().len());
        if first != Some(&0) || !ends_with_knots {
            return Err(Error::input(format!(
                "trajectories do not cover the {} knots",
                self.knots().len()
            )));
        }
        // Before trajectories are sliced: a decrease would put a slice outside the table.
        if let Some(v) = self.first_knot().windows(2).position(|pair| pair[0] > pair[1]) {
            return Err(Error::input(format!("vertex {v} ends before it starts")));
        }
        for v in 0..self.n_vertices() as u32 {
            let trajectory = self.trajectory(v);
            for (i, knot) in trajectory.iter().enumerate() {
                let increases = i == 0 || trajectory[i - 1].rank < knot.rank;
                if !increases || knot.rank as usize >= self.isovalues().len() {
                    return Err(Error::input(format!(
                        "vertex {v}: knot {i} has rank {}, expected increasing ranks below {}",
                        knot.rank,
                        self.isovalues().len()
                    )));
                }
                // A NaN fails this comparison.
                if !knot.position.iter().all(|x| x.abs() <= MAX_COORDINATE) {
                    return Err(Error::input(format!(
                        "vertex {v}: knot {i} is at {:?}, expected coordinates up to {MAX_COORDINATE}",
                        knot.position
                    )));
                }
            }
        }
        Ok(())
    }

    /// The violation of a triangle. Trajectories must have been checked before.
    fn check_triangle(&self, triangle: &Triangle) -> std::result::Result<(), String> {
        let [a, b, c] = triangle.vertices;
        if a == b || b == c || c == a {
            return Err(format!("vertices {a}, {b}, {c}, expected three different ones"));
        }
        if triangle.birth >= triangle.death || triangle.death as usize >= self.isovalues().len() {
            return Err(format!(
                "lifetime [{}, {}), expected increasing ranks below {}",
                triangle.birth,
                triangle.death,
                self.isovalues().len()
            ));
        }
        for v in triangle.vertices {
            if v as usize >= self.n_vertices() {
                return Err(format!("vertex {v}, expected one of {}", self.n_vertices()));
            }
            let trajectory = self.trajectory(v);
            let covers = |first: u32, last: u32| first <= triangle.birth && triangle.death <= last;
            match (trajectory.first(), trajectory.last()) {
                (Some(first), Some(last)) if covers(first.rank, last.rank) => {}
                _ => {
                    return Err(format!(
                        "vertex {v} has no knots from {} to {}",
                        triangle.birth, triangle.death
                    ));
                }
            }
        }
        Ok(())
    }
}

/// Checks the collapses of a spectrum with so many vertices and isovalues, as [`Spectrum::check`].
///
/// # Errors
///
/// As there.
pub(crate) fn check_collapses(
    collapses: &[Collapse],
    n_vertices: u64,
    n_isovalues: usize,
) -> Result<()> {
    for (i, collapse) in collapses.iter().enumerate() {
        let Collapse { vertex, target, rank, .. } = *collapse;
        if u64::from(vertex.max(target)) >= n_vertices || vertex == target {
            return Err(Error::input(format!(
                "collapse {i}: vertex {vertex} onto {target}, expected two different vertices below {n_vertices}"
            )));
        }
        if rank as usize >= n_isovalues {
            return Err(Error::input(format!(
                "collapse {i}: rank {rank}, expected one of {n_isovalues} isovalues"
            )));
        }
    }
    Ok(())
}
