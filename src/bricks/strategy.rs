//! The choice between sweeping a volume as a whole and in bricks.

use super::blocks::cut;
use super::plan::SIDE;
use crate::error::Result;
use crate::forecast::Forecast;
use crate::prepared::Prepared;
use crate::sweep::Parameters;

/// Cells along the side of the smallest bricks that are chosen; smaller ones are mostly border.
const LEAST_SIDE: usize = SIDE / 8;

/// Most of the memory that the mean brick may take: its neighbours may have several times as much surface.
const MAX_BRICK_SHARE: f64 = 0.25;

/// Whether a volume is swept as a whole or in bricks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strategy {
    /// As a whole, with the forecast of that sweep.
    Whole(Forecast),
    /// In bricks, because a sweep of the whole is expected to exceed the memory.
    Bricks {
        /// Memory expected for a sweep of the whole, bytes.
        expected_memory: f64,
        /// Cells along the side of a brick: [`side_within`] the memory.
        side: usize,
    },
}

impl Strategy {
    /// Chooses bricks if a sweep of the whole is expected to take more than `memory` bytes and the volume [can be
    /// cut](is_divisible), else the whole. A whole that exceeds `memory` is left to the caller to refuse.
    ///
    /// # Errors
    ///
    /// Those of [`Forecast::of_volume`].
    pub fn choose(
        prepared: &Prepared,
        parameters: &Parameters,
        memory: Option<f64>,
    ) -> Result<Strategy> {
        let volume = prepared.volume();
        let limit = memory.filter(|_| is_divisible(volume.dims(), parameters));
        let in_bricks = |expected_memory| {
            let side = side_within(volume.dims(), expected_memory, limit.unwrap_or(f64::INFINITY));
            Strategy::Bricks { expected_memory, side }
        };
        // The samples alone may decide, which takes no time.
        let least = Forecast::least_memory(volume.dims());
        if limit.is_some_and(|limit| least > limit) {
            return Ok(in_bricks(least));
        }
        let range = parameters.range.unwrap_or(volume.range());
        let forecast = prepared.forecast(range, parameters.error)?;
        log::debug!("{forecast:?}");
        if limit.is_some_and(|limit| forecast.memory > limit) {
            return Ok(in_bricks(forecast.memory));
        }
        Ok(Strategy::Whole(forecast))
    }
}

/// Cells along the side of bricks for a volume of `dims` samples whose sweep is expected to take `expected` bytes: the default, or
/// the first half or quarter of it that cuts the volume and leaves `memory` bytes enough for each brick.
pub fn side_within(dims: [usize; 3], expected: f64, memory: f64) -> usize {
    let is_small = |side: usize| {
        let n = cut(dims, side).len();
        n > 1 && expected / n as f64 <= MAX_BRICK_SHARE * memory
    };
    [SIDE, SIDE / 2, SIDE / 4].into_iter().find(|&side| is_small(side)).unwrap_or(LEAST_SIDE)
}

/// True if bricks reduce the memory of a sweep: the volume has more than one of them, and there is no initial
/// mesh, which is a mesh of the whole.
pub fn is_divisible(dims: [usize; 3], parameters: &Parameters) -> bool {
    parameters.initial_mesh.is_none() && cut(dims, LEAST_SIDE).len() > 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepared::Noise;
    use crate::volume::{Placement, Preparation, Samples, Volume};

    #[test]
    fn a_volume_is_cut_if_its_sweep_exceeds_the_memory_and_bricks_help() {
        let prepared = |dims: [usize; 3]| {
            let samples = (0..dims.iter().product()).map(|i: usize| (i % 7) as u8).collect();
            let volume = Volume::new("v", dims, Samples::U8(samples), Placement::default());
            let volume = volume.expect("a volume");
            Prepared::new(volume, Preparation::default(), Noise::default()).expect("prepared")
        };
        let (long, small) = (prepared([400, 3, 3]), prepared([5; 3]));
        let default = Parameters::default();
        let choose = |prepared, parameters: &Parameters, memory| {
            Strategy::choose(prepared, parameters, memory).expect("a strategy")
        };
        let Strategy::Whole(forecast) = choose(&long, &default, None) else {
            panic!("bricks without a limit of memory")
        };
        assert_eq!(choose(&long, &default, Some(forecast.memory)), Strategy::Whole(forecast));
        let expected_memory = forecast.memory;
        assert_eq!(
            choose(&long, &default, Some(0.99 * forecast.memory)),
            Strategy::Bricks { expected_memory, side: 64 }
        );
        let expected_memory = Forecast::least_memory([400, 3, 3]);
        assert_eq!(
            choose(&long, &default, Some(1.0)),
            Strategy::Bricks { expected_memory, side: 16 }
        );
        // 27, 125, 1,000 and 8,000 bricks.
        let side = |expected| side_within([321; 3], expected, 1e9);
        assert_eq!([6.7e9, 31e9, 249e9, 251e9].map(side), [128, 64, 32, 16]);
        assert!(matches!(choose(&small, &default, Some(1.0)), Strategy::Whole(_)));
        let given = Parameters { initial_mesh: Some("m.ply".into()), ..default };
        assert!(matches!(choose(&long, &given, Some(1.0)), Strategy::Whole(_)));
    }
}
