//! The march: all stretches, in both directions, step by step.

use std::iter;
use std::sync::Mutex;

use rayon::prelude::*;

use super::length::CALM_FACTOR;
use super::state::{March, State, WorkDone, sorted};
use super::stretches::{Stretch, stretches};
use crate::error::Result;
use crate::kernels::{DeviceWork, Kernels};
use crate::mesh::Vertex;
use crate::sweep::calendar::{Calendar, Passage};
use crate::sweep::context::Sweep;
use crate::sweep::counts::Counts;
use crate::sweep::exact::ExactInterval;
use crate::sweep::initial::InitialMesh;
use crate::sweep::record::Recorder;
use crate::sweep::transport::{Step, typical_slope};

/// The results of marches.
#[derive(Default)]
pub(in crate::sweep) struct Marched {
    pub(in crate::sweep) record: Recorder,
    pub(in crate::sweep) exact_intervals: Vec<ExactInterval>,
    pub(in crate::sweep) counts: Counts,
}

/// Marches up and down from the start of each stretch, all in parallel.
pub(in crate::sweep) fn march(sweep: &Sweep, initial: Option<InitialMesh>) -> Result<Marched> {
    let calendar = Calendar::new(&sweep.exact, &sweep.topology, sweep.range);
    let done = WorkDone { share: Mutex::new(0.0), stage: sweep.stages.tracking(sweep.progress) };
    let stretches = stretches(sweep, &calendar);
    // A sweep with an initial mesh has one start.
    let initial = iter::once(initial).chain(iter::repeat_with(|| None));
    let starts: Vec<(Stretch, Option<InitialMesh>)> = stretches.into_iter().zip(initial).collect();
    let marches = starts.into_par_iter().with_max_len(1);
    let marches =
        marches.map(|(stretch, initial)| march_stretch(sweep, &calendar, &done, stretch, initial));
    let mut marched = Marched::default();
    for each in marches.collect::<Vec<Result<Marched>>>() {
        marched.add(each?, 0);
    }
    done.stage.report(1.0);
    Ok(marched)
}

impl Marched {
    fn of(March { record, exact_intervals, mut counts, .. }: March) -> Marched {
        record.ended.insert_into(&mut counts);
        Marched { record, exact_intervals, counts }
    }

    /// Appends the results of another march; `n_common` trajectories are common to both.
    fn add(&mut self, other: Marched, n_common: usize) {
        self.record.join(other.record, n_common);
        self.exact_intervals.extend(other.exact_intervals);
        self.counts.add(&other.counts);
    }
}

/// Marches up and down from the start of a stretch, in parallel.
fn march_stretch(
    sweep: &Sweep,
    calendar: &Calendar,
    done: &WorkDone,
    Stretch { low, start, high }: Stretch,
    initial: Option<InitialMesh>,
) -> Result<Marched> {
    let mut kernels = sweep.backend.kernels(&sweep.field)?;
    let (mut up, mut state) = March::new(sweep, calendar, done, start, initial)?;
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
    let mut marched = Marched::of(up);
    marched.add(Marched::of(down), n_common);
    Ok(marched)
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
        let mut usual = length;
        while state.at != last {
            self.sweep.cancelled()?;
            let step = Step { at: state.at, next: self.next(state.at, last, length) };
            // The threshold is half-way between both lengths, as steps end between grey levels.
            let is_long = (step.next - step.at).abs() > 0.5 * (1.0 + CALM_FACTOR) * usual
                && !Self::is_shortest(step);
            if !self.take_step(state, step, is_long, kernels)? {
                length = 0.5 * (step.next - step.at).abs();
                continue;
            }
            self.done.add(self.calendar.work(self.sweep.range, [step.at, step.next]));
            if let Some(fixed) = self.fixed() {
                (usual, length) = (fixed, fixed);
                continue;
            }
            let mesh = &state.tracked.mesh;
            let free: Vec<Vertex> = mesh.vertices().filter(|&v| !mesh.is_fixed(v)).collect();
            let slope = typical_slope(self.field(), free.par_iter().map(|&v| mesh.position(v)));
            if let Some(slope) = slope {
                usual = self.length_for(slope);
                let times = if self.is_calm(state, &state.region) { CALM_FACTOR } else { 1.0 };
                length = (times * usual).clamp(0.5 * length, 1.6 * length);
            }
        }
        log::debug!("march to {last} ends");
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
