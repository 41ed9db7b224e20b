//! The march: both directions, step by step.

use std::sync::Mutex;

use super::length::{CALM_FACTOR, REGROWTH_FACTOR, start};
use super::state::{March, State, WorkDone, sorted};
use crate::error::Result;
use crate::kernels::{DeviceWork, Kernels};
use crate::sweep::calendar::{Calendar, Passage};
use crate::sweep::context::Sweep;
use crate::sweep::counts::Counts;
use crate::sweep::exact::ExactInterval;
use crate::sweep::initial::InitialMesh;
use crate::sweep::record::Recorder;
use crate::sweep::transport::{Step, typical_slope};

/// The results of both directions.
pub(in crate::sweep) struct Marched {
    pub(in crate::sweep) record: Recorder,
    pub(in crate::sweep) exact_intervals: Vec<ExactInterval>,
    pub(in crate::sweep) counts: Counts,
}

/// Marches up and down from the start, in parallel.
pub(in crate::sweep) fn march(sweep: &Sweep, initial: Option<InitialMesh>) -> Result<Marched> {
    let calendar = Calendar::new(&sweep.exact, &sweep.topology, sweep.range);
    let start = sweep.parameters.start.unwrap_or_else(|| start(sweep, &calendar));
    let done = WorkDone { share: Mutex::new(0.0), stage: sweep.stages.tracking(sweep.progress) };
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let (low, high) = sweep.range;
    let (mut up, mut state) = March::new(sweep, &calendar, &done, start, initial)?;
    let length = up.first_step(start);
    let around = [(start - length).max(low), (start + length).min(high)];
    let region = up.plan(&mut state, around);
    let passage = Passage::between(&sweep.exact, around[0], around[1]);
    up.exchange(&mut state, region, passage, &mut *kernels)?;
    let mut down = up.fork();
    let n_common = down.record.knots.len();
    let begun = state.clone();
    let (went_up, went_down) = rayon::join(
        || up.march_to(state, high, length, &mut *kernels),
        || down.march_to(begun, low, length, &mut *sweep.backend.kernels(&sweep.field)?),
    );
    went_up.and(went_down)?;
    let March { mut record, mut exact_intervals, mut counts, .. } = up;
    record.join(down.record, n_common);
    exact_intervals.extend(down.exact_intervals);
    counts.add(&down.counts);
    done.stage.report(1.0);
    Ok(Marched { record, exact_intervals, counts })
}

impl March<'_, '_> {
    /// Marches to an isovalue.
    fn march_to(
        &mut self,
        mut state: State,
        last: f64,
        mut length: f64,
        kernels: &mut dyn Kernels,
    ) -> Result<()> {
        let state = &mut state;
        let (mut usual, mut most) = (length, f64::INFINITY);
        while state.at != last {
            self.sweep.cancelled()?;
            let step = Step { at: state.at, next: self.next(state.at, last, length) };
            // The threshold is half-way between both lengths, as steps end between grey levels.
            let is_long = (step.next - step.at).abs() > 0.5 * (1.0 + CALM_FACTOR) * usual
                && !Self::is_shortest(step);
            if !self.take_step(state, step, is_long, kernels)? {
                length = 0.5 * (step.next - step.at).abs();
                if self.level() > 0.0 {
                    most = length;
                }
                continue;
            }
            most *= REGROWTH_FACTOR;
            self.done.add(self.calendar.work(self.sweep.range, [step.at, step.next]));
            if let Some(fixed) = self.fixed() {
                (usual, length) = (fixed, fixed);
                continue;
            }
            let positions =
                state.tracked.mesh.vertices().filter(|&v| !state.tracked.mesh.is_fixed(v));
            let slope =
                typical_slope(self.field(), positions.map(|v| state.tracked.mesh.position(v)));
            if let Some(slope) = slope {
                usual = self.length_for(slope);
                let times = if self.is_calm(state, &state.region) { CALM_FACTOR } else { 1.0 };
                length = (times * usual).clamp(0.5 * length, 1.6 * length).min(most);
            }
        }
        self.count(kernels.device_work());
        self.record.finish(last);
        for (block, since) in sorted(std::mem::take(&mut state.since)) {
            self.record_exact(block, since, last);
        }
        Ok(())
    }

    fn count(&mut self, DeviceWork { submissions, read_backs }: DeviceWork) {
        self.counts.submissions += submissions;
        self.counts.read_backs += read_backs;
    }
}
