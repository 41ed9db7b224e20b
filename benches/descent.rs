//! The alternative of the thesis's section 3.4, compared with the projection: rays are intersected with the triangles of the cells,
//! and the hit is moved by steepest descent, in place of solving the cubic.
//!
//! `cargo bench -p isospectrum-benches --bench descent`; `-- --descent 2` limits the steps of the descent. The volumes
//! are read from the folder `ISOSPECTRUM_DATA`, or from `../shared/data`. Meshes go from an exact extraction to another isovalue
//! in steps of equal length for all methods, without remeshing, and are relaxed after each step. Times are those of moving the
//! vertices of the projection's meshes, on one thread, without normals and relaxation.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use isospectrum::Result;
use isospectrum::unstable::extract::extract;
use isospectrum::unstable::field::Field;
use isospectrum::unstable::kernels::{Advance, CpuKernels, Kernels, Relaxation};
use isospectrum::unstable::mesh::{Connectivity, HalfEdgeMesh};
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::{ReadOptions, read_volume};

#[path = "descent/measure.rs"]
mod measure;
#[path = "descent/methods.rs"]
mod methods;

use measure::Tally;
use methods::{Method, Mover, REACH};

/// How far nine of ten vertices move in a step at most, voxels.
const STEP_LENGTHS: [f32; 2] = [0.25, 1.0];

/// Number of steps to a target at most.
const MAX_STEPS: usize = 200;

/// Number of steps of the descent at most, unless given.
const DESCENT_STEPS: u32 = 8;

/// Number of times that all vertices are moved to measure the time.
const N_ROUNDS: usize = 5;

/// Number of moves in a round at least: some tenths of a second.
const MIN_MOVES: usize = 200_000;

/// Pairs of isovalues in a volume: from the start to the target.
struct Case {
    volume: &'static str,
    place: &'static str,
    pairs: [(f64, f64); 3],
}

/// Away from events, and shortly before or across some; no large part of a mesh vanishes on the way.
const CASES: [Case; 4] = [
    Case {
        volume: "nucleon_41x41x41_uint8.raw",
        place: "calm",
        pairs: [(30.5, 50.5), (95.5, 65.5), (125.5, 150.5)],
    },
    Case {
        volume: "nucleon_41x41x41_uint8.raw",
        place: "critical",
        pairs: [(97.5, 110.5), (155.5, 166.5), (170.5, 187.5)],
    },
    Case {
        volume: "hydrogen_atom_128x128x128_uint8.raw",
        place: "calm",
        pairs: [(14.5, 18.5), (22.5, 28.5), (60.5, 45.5)],
    },
    Case {
        volume: "hydrogen_atom_128x128x128_uint8.raw",
        place: "critical",
        pairs: [(8.5, 14.5), (30.5, 35.75), (70.5, 79.5)],
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|a| a == flag);
    // `cargo bench` passes `--bench`; `cargo test --benches` does not.
    if has("--test") || !has("--bench") {
        println!(
            "descent: nothing to test, run it by `cargo bench -p isospectrum-benches --bench descent`"
        );
        return ExitCode::SUCCESS;
    }
    let given = arguments.iter().position(|a| a == "--descent").map(|i| arguments.get(i + 1));
    let descent_steps = match given {
        None => Some(DESCENT_STEPS),
        Some(number) => number.and_then(|n| n.parse().ok()),
    };
    let Some(descent_steps) = descent_steps else {
        eprintln!("descent: --descent, expected a number of steps");
        return ExitCode::from(2);
    };
    match run(descent_steps) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("descent: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The path of a volume; as an error if it is missing.
fn volume_path(name: &str) -> std::result::Result<PathBuf, PathBuf> {
    let default = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let path = std::env::var_os("ISOSPECTRUM_DATA").map_or_else(default, PathBuf::from).join(name);
    if path.is_file() { Ok(path) } else { Err(path) }
}

fn run(descent_steps: u32) -> Result<()> {
    println!("at most {descent_steps} steps of the descent; lengths in voxels, shares in %");
    println!(
        "| volume | step | method | vertices: median, 99 %, max | barycentres: median, 99 % | radius ratio, < .1 | no hit | jumped | turned | time, less extraction |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for case in &CASES {
        match volume_path(case.volume) {
            Ok(path) => run_case(case, &path, descent_steps)?,
            Err(path) => println!(
                "descent: NOT RUN: {} is missing; set ISOSPECTRUM_DATA to its folder",
                path.display()
            ),
        }
    }
    Ok(())
}

/// Prints the rows of one case.
fn run_case(case: &Case, path: &Path, descent_steps: u32) -> Result<()> {
    let volume = Arc::new(read_volume(path, &ReadOptions::default())?);
    let field = Arc::new(Field::new(volume.clone()));
    let exact = ExactField::new(&volume)?;
    let mover =
        Mover { field: &field, exact: &exact, descent_steps, extraction: Duration::default() };
    let mut bench = Bench { kernels: CpuKernels::new(field.clone()), mover };
    let starts: Vec<Start> =
        case.pairs.iter().map(|pair| bench.start(pair.0)).collect::<Result<_>>()?;
    for length in STEP_LENGTHS {
        let mut tallies = Method::ALL.map(|_| Tally::default());
        let mut inputs = Vec::new();
        for (start, &(_, target)) in starts.iter().zip(&case.pairs) {
            let steps = bench.project_to(start, target, length, &mut tallies[0])?;
            for (method, tally) in Method::ALL.into_iter().zip(&mut tallies).skip(1) {
                bench.follow(method, start, &steps, tally)?;
            }
            inputs.extend(steps);
        }
        let times = bench.times(&inputs);
        let name = case.volume.split('_').next().unwrap_or_default();
        for ((method, tally), [time, without]) in Method::ALL.into_iter().zip(tallies).zip(times) {
            println!(
                "| {name}, {} | {length} | {} | {} | {time:.2}, {without:.2} |",
                case.place,
                method.name(),
                tally.columns(),
            );
        }
        let n_moved: usize = inputs.iter().map(|i| i.free.len()).sum();
        eprintln!("{name}, {}, {length}: {} steps, {n_moved} moves", case.place, inputs.len());
    }
    print_starts(case, &exact, &field, &starts)
}

/// Prints the events of a case, and the shape of its meshes before the first step, to stderr.
fn print_starts(case: &Case, exact: &ExactField, field: &Field, starts: &[Start]) -> Result<()> {
    let topology = Topology::compute(exact)?;
    for (start, &(from, to)) in starts.iter().zip(&case.pairs) {
        let is_between = |c: f64| from.min(to) < c && c < from.max(to);
        let events = topology.net_events();
        let n_events = events.iter().filter(|e| is_between(e.isovalue)).count();
        let mut tally = Tally::default();
        let isovalue = field.isovalue(from);
        tally.add_mesh(field, &start.connectivity, &start.state.positions, isovalue);
        let n = start.free.len();
        eprintln!("{from} to {to}: {n} vertices, {n_events} events; start {}", tally.shape());
    }
    Ok(())
}

/// Positions and unit normals of a mesh, by vertex.
#[derive(Clone)]
struct State {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
}

/// The exact extraction at an isovalue.
struct Start {
    isovalue: f64,
    connectivity: Connectivity,
    /// The vertices that move: those outside caps.
    free: Vec<usize>,
    state: State,
}

/// The free vertices before a step, with their normals, and the isovalue after it.
struct Step {
    free: Vec<(Vec3, Vec3)>,
    isovalue: f64,
}

struct Bench<'a> {
    kernels: CpuKernels,
    mover: Mover<'a>,
}

impl Bench<'_> {
    fn start(&mut self, isovalue: f64) -> Result<Start> {
        let extraction = extract(self.mover.exact, isovalue);
        let is_fixed = vec![false; extraction.positions.len()];
        let (positions, faces) = (&extraction.positions, &extraction.faces);
        let no_caps = vec![false; faces.len()];
        let mesh = HalfEdgeMesh::from_triangles(positions, &is_fixed, faces, &no_caps)?;
        let mut connectivity = mesh.compacted().connectivity;
        for (face, _) in faces.iter().zip(&extraction.caps).filter(|(_, is_cap)| **is_cap) {
            face.iter().for_each(|&v| connectivity.constrained[v as usize] = 1);
        }
        let free = (0..positions.len()).filter(|&v| connectivity.constrained[v] == 0).collect();
        let positions: Vec<Vec3> = positions.iter().map(|&p| p.into()).collect();
        let state = self.relaxed(&connectivity, &positions, isovalue, 0)?;
        Ok(Start { isovalue, connectivity, free, state })
    }

    /// Relaxes a mesh at an isovalue, as a sweep does.
    fn relaxed(
        &mut self,
        connectivity: &Connectivity,
        positions: &[Vec3],
        isovalue: f64,
        max_iterations: u32,
    ) -> Result<State> {
        let positions: Vec<[f32; 3]> = positions.iter().map(Vec3::to_array).collect();
        self.kernels.load(connectivity, &positions)?;
        let relaxation = Relaxation { isovalue, strength: 0.6, threshold: 1e-4, max_iterations };
        let advance = Advance { isovalues: &[], reach: REACH, ends: &[], relaxation };
        let advanced = self.kernels.advance(&advance)?;
        let [positions, normals] = [advanced.positions, advanced.normals]
            .map(|vectors| vectors.into_iter().map(Vec3::from).collect());
        Ok(State { positions, normals })
    }

    /// Moves a mesh to the next isovalue and relaxes it there.
    fn step(
        &mut self,
        method: Method,
        start: &Start,
        state: &State,
        isovalue: f64,
        tally: &mut Tally,
    ) -> Result<State> {
        let field = self.mover.field;
        let mut positions = state.positions.clone();
        for &v in &start.free {
            let p = positions[v];
            let q = self.mover.moved(method, p, state.normals[v], isovalue);
            tally.add_vertex(field, p, q, field.isovalue(isovalue));
            positions[v] = q.unwrap_or(p);
        }
        // As many iterations as in a sweep.
        self.relaxed(&start.connectivity, &positions, isovalue, 6)
    }

    /// Projects a mesh to the target; returns the steps.
    fn project_to(
        &mut self,
        start: &Start,
        target: f64,
        length: f32,
        tally: &mut Tally,
    ) -> Result<Vec<Step>> {
        let mut state = start.state.clone();
        let mut at = start.isovalue;
        let mut steps = Vec::new();
        while at != target && steps.len() < MAX_STEPS {
            let free: Vec<(Vec3, Vec3)> =
                start.free.iter().map(|&v| (state.positions[v], state.normals[v])).collect();
            let change = f64::from(length * typical_slope(self.mover.field, &free));
            let remaining = target - at;
            at = if remaining.abs() <= change { target } else { at + change * remaining.signum() };
            state = self.step(Method::Projection, start, &state, at, tally)?;
            steps.push(Step { free, isovalue: at });
        }
        self.add_end(start, &state, at, tally);
        Ok(steps)
    }

    /// Moves a mesh by another method in the same steps.
    fn follow(
        &mut self,
        method: Method,
        start: &Start,
        steps: &[Step],
        tally: &mut Tally,
    ) -> Result<()> {
        let mut state = start.state.clone();
        for step in steps {
            state = self.step(method, start, &state, step.isovalue, tally)?;
        }
        let last = steps.last().map_or(start.isovalue, |s| s.isovalue);
        self.add_end(start, &state, last, tally);
        Ok(())
    }

    fn add_end(&self, start: &Start, state: &State, isovalue: f64, tally: &mut Tally) {
        let field = self.mover.field;
        let isovalue = field.isovalue(isovalue);
        tally.add_mesh(field, &start.connectivity, &state.positions, isovalue);
    }

    /// By method, the time for moving all vertices, with and without the extraction of cells, over that of the first
    /// method in the same round; medians.
    fn times(&mut self, steps: &[Step]) -> [[f64; 2]; 3] {
        let rounds: Vec<[[f64; 2]; 3]> = (0..N_ROUNDS)
            .map(|_| {
                let seconds = Method::ALL.map(|method| self.seconds(method, steps));
                let first = seconds[0][0];
                seconds.map(|both| both.map(|s| s / first))
            })
            .collect();
        std::array::from_fn(|m| {
            std::array::from_fn(|i| {
                let mut ratios: Vec<f64> = rounds.iter().map(|r| r[m][i]).collect();
                ratios.sort_by(f64::total_cmp);
                ratios[N_ROUNDS / 2]
            })
        })
    }

    /// Seconds for moving all vertices, with and without the extraction of cells.
    fn seconds(&mut self, method: Method, steps: &[Step]) -> [f64; 2] {
        let n_moves: usize = steps.iter().map(|s| s.free.len()).sum();
        let n_repeats = MIN_MOVES.div_ceil(n_moves.max(1));
        self.mover.extraction = Duration::default();
        let started = Instant::now();
        for step in std::iter::repeat_n(steps, n_repeats).flatten() {
            for &(p, n) in &step.free {
                std::hint::black_box(self.mover.moved(method, p, n, step.isovalue));
            }
        }
        let all = started.elapsed();
        [all, all.saturating_sub(self.mover.extraction)].map(|time| time.as_secs_f64())
    }
}

/// The slope that nine of ten positions reach.
fn typical_slope(field: &Field, positions: &[(Vec3, Vec3)]) -> f32 {
    let mut slopes: Vec<f32> = positions.iter().map(|(p, _)| field.inner_slope(*p)).collect();
    let i = slopes.len() / 10;
    slopes.select_nth_unstable_by(i, f32::total_cmp);
    slopes[i]
}
