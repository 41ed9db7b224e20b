//! Bricks: parts swept apart fit each other, whoever computes them when. See `docs/decisions/0004-bricks.md`.

mod program;
mod random;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isospectrum::bricks::{Opened, Part, Plan, Source, merge};
use isospectrum::extract::count::count;
use isospectrum::kernels::{Backend, Choice};
use isospectrum::prepared::{Cleaned, Noise, Prepared};
use isospectrum::spectrum::{Query, Spectrum};
use isospectrum::sweep::{Block, Parameters, Silent, compute_block};
use isospectrum::topology::Topology;
use isospectrum::topology::blocks::BlockTopology;
use isospectrum::topology::exact::ExactField;
use isospectrum::verify::mesh_topology;
use isospectrum::volume::{Outside, Placement, Preparation, Samples, Volume, phantom, read_volume};
use program::{Folder, stderr};
use random::Random;

fn cpu() -> Backend {
    Backend::choose(Choice::Cpu, None).expect("the CPU")
}

/// A volume in bricks: its plan and what is swept of each.
struct Bricks {
    volume: Arc<Volume>,
    opened: Opened,
    plan: Plan,
    blocks: Vec<Block>,
    topologies: Vec<BlockTopology>,
}

impl Bricks {
    fn of(volume: Volume, side: usize, range: Option<(f64, f64)>) -> Bricks {
        let prepared = Prepared::of(volume, Preparation::default(), Cleaned::default());
        let volume = prepared.volume().clone();
        // Nothing is read anew here.
        let source = Source::Phantom { name: "-".to_owned(), outside: volume.outside() };
        let parameters = Parameters { range, ..Parameters::default() };
        let plan = Plan::new(source, &prepared, Noise::default(), &parameters, side);
        let plan = plan.expect("a plan");
        let opened = Opened::Whole(prepared);
        let swept = |number| {
            let block = Arc::new(plan.block(&opened, number).expect("a block"));
            compute_block(&block, &plan.recipe.parameters, &cpu(), &Silent).expect("swept")
        };
        let numbers = 0..plan.recipe.bricks.len();
        let blocks = numbers.clone().map(swept).collect();
        let topology = |number| plan.topology(&opened, number).expect("a topology");
        let topologies = numbers.map(topology).collect();
        Bricks { volume, opened, plan, blocks, topologies }
    }

    fn part(&self, number: usize) -> Vec<u8> {
        let told = (&self.blocks[number], &self.topologies[number]);
        Part::to_bytes(&self.plan, number, "cpu", told).expect("packed")
    }

    fn merged(&self) -> Spectrum {
        let parts = (0..self.blocks.len()).map(|number| {
            Part::from_bytes(&self.part(number), &self.plan, number).expect("as it was written")
        });
        merge(&self.plan, parts.collect(), &self.opened).expect("parts that fit")
    }
}

/// A volume cut to other dimensions.
fn cropped(name: &str, dims: [usize; 3]) -> Volume {
    let crop = Some(dims.map(|n| [0, n]));
    let preparation = Preparation { crop, ..Preparation::default() };
    preparation.apply(phantom(name).expect("a phantom")).expect("inside")
}

fn in_grey_levels(volume: &Volume, n: f64) -> Volume {
    let (low, high) = volume.range();
    let samples = volume.samples();
    let grey = |x: f64| (n * (x - low) / (high - low)).round() as u8;
    let samples = (0..samples.len()).map(|i| grey(samples.get(i))).collect();
    let levels = Volume::new("levels", volume.dims(), Samples::U8(samples), Placement::default());
    levels.expect("a valid volume")
}

/// Random isovalues of a range.
fn isovalues((low, high): (f64, f64), n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    (0..n).map(|_| low + random.unit() * (high - low)).collect()
}

/// Checks that the mesh is closed at all isovalues and has the counted topology, and that events are those of the whole.
fn check(name: &str, bricks: &Bricks, n: usize) -> Spectrum {
    let spectrum = bricks.merged();
    let volume = &bricks.volume;
    let field = ExactField::new(volume).expect("a field");
    let mut query = Query::new(&spectrum);
    let mut at = isovalues(spectrum.range, n, 30);
    // Where samples are passed.
    let samples = isovalues(spectrum.range, n / 4, 31);
    at.extend(samples.iter().map(|c| c.round()).filter(|_| volume.samples().is_integer()));
    for c in at {
        let mesh = query.mesh_at(c).expect("inside the range");
        let found = mesh_topology(mesh.positions.len(), &mesh.triangles);
        assert!(found.is_closed_manifold(), "{name} at {c}: {found:?}");
        let expected = count(&field, c);
        let euler: i64 = expected.iter().map(|component| component.euler).sum();
        assert_eq!((found.components, found.euler), (expected.len(), euler), "{name} at {c}");
    }
    let topology = Topology::compute(&field).expect("a topology");
    let (low, high) = spectrum.range;
    let inside = topology.net_events().into_iter().filter(|e| (low..=high).contains(&e.isovalue));
    assert_eq!(spectrum.events, inside.collect::<Vec<_>>(), "{name}");
    spectrum
}

#[test]
fn the_merged_mesh_is_closed_and_right_at_random_isovalues() {
    for (name, volume) in [
        ("noise 2x2x2", cropped("noise:17:301", [17, 16, 17])),
        ("noise 3x1x2", cropped("noise:25:7", [25, 9, 17])),
        ("levels 2x2x2", in_grey_levels(&cropped("noise:17:302", [16, 17, 15]), 12.0)),
        ("levels 3x1x2", in_grey_levels(&cropped("noise:25:8", [25, 8, 17]), 40.0)),
        ("high 2x2x2", phantom("gyroid:17").expect("a phantom").with_outside(Outside::High)),
    ] {
        let bricks = Bricks::of(volume, 8, None);
        assert!(bricks.blocks.len() >= 6, "{name}: {} bricks", bricks.blocks.len());
        let spectrum = check(name, &bricks, 48);
        let n_tracked: f64 = bricks.blocks.iter().flat_map(|b| &b.areas).map(|a| a[0]).sum();
        assert!(n_tracked > 0.0 && spectrum.triangles.len() > 1000, "{name}: nothing is tracked");
    }
}

#[test]
fn white_noise_of_float64_fits() {
    let mut random = Random(5);
    for scale in [1e-3, 1.0, 1e6] {
        let samples = (0..13 * 9 * 8).map(|_| (random.unit() - 0.5) * scale).collect();
        let volume = Volume::new("white", [13, 9, 8], Samples::F64(samples), Placement::default());
        check(&format!("{scale}"), &Bricks::of(volume.expect("a volume"), 4, None), 32);
    }
}

#[test]
fn a_range_and_anisotropic_spacing_fit() {
    let volume = phantom("blobs:21").expect("a phantom");
    let placement = Placement { spacing: [0.7, 1.0, 1.9], ..Placement::default() };
    let volume = Volume::new("b", volume.dims(), volume.samples().clone(), placement);
    let volume = volume.expect("a volume");
    let (low, high) = volume.range();
    let range = (low + 0.3 * (high - low), low + 0.7 * (high - low));
    let spectrum = check("blobs", &Bricks::of(volume, 10, Some(range)), 32);
    assert_eq!(spectrum.range, range);
}

/// Trajectories at the vertices of shared planes, by lattice edge.
type Seam = BTreeMap<u64, Vec<(f64, [f32; 3])>>;

fn seam(block: &Block) -> Seam {
    let s = &block.spectrum;
    let knots = |v: u32| {
        let all = s.trajectory(v).iter();
        all.map(|k| (s.isovalues[k.rank as usize], k.position)).collect()
    };
    block.shared.iter().map(|&(v, edge)| (edge, knots(v))).collect()
}

#[test]
fn both_sides_of_a_shared_plane_have_the_same_vertices_and_trajectories() {
    // Two bricks: all that is shared is shared by both.
    for name in ["noise:17:11", "gyroid:17"] {
        let volume = in_grey_levels(&cropped(name, [17, 9, 9]), 200.0);
        let bricks = Bricks::of(volume, 8, None);
        assert_eq!(bricks.blocks.len(), 2);
        let [a, b] = [0, 1].map(|i| seam(&bricks.blocks[i]));
        assert!(a.len() > 20, "{name}: {} vertices", a.len());
        assert_eq!(a, b, "{name}");
    }
}

#[test]
fn parts_of_another_volume_or_plan_are_refused() {
    let volume = |seed| in_grey_levels(&cropped(&format!("noise:17:{seed}"), [17, 9, 9]), 60.0);
    let [a, b] = [volume(1), volume(2)].map(|v| Bricks::of(v, 8, None));
    let refused = Part::from_bytes(&b.part(0), &a.plan, 0).expect_err("of another plan");
    assert!(refused.to_string().contains("expected part 0 of plan"), "{refused}");
    let refused = Part::from_bytes(&a.part(0), &a.plan, 1).expect_err("of another brick");
    assert!(refused.to_string().contains("part 0 of plan"), "{refused}");
    let other = a.plan.block(&b.opened, 0).expect_err("of other samples");
    assert!(other.to_string().contains("expected the same samples"), "{other}");
    // Were it not for the hash: the sides do not fit.
    let forged = Bricks { blocks: vec![a.blocks[0].clone(), b.blocks[1].clone()], ..a };
    let parts = [0, 1].map(|n| Part::from_bytes(&forged.part(n), &forged.plan, n).expect("read"));
    let refused = merge(&forged.plan, parts.into(), &forged.opened);
    let refused = refused.expect_err("sides that differ");
    assert!(refused.to_string().contains("has another vertex"), "{refused}");
}

#[test]
fn every_damaged_byte_of_a_part_is_found_and_none_is_a_panic() {
    let volume = in_grey_levels(&cropped("noise:17:3", [17, 9, 9]), 9.0);
    let bricks = Bricks::of(volume, 8, None);
    let whole = bricks.part(0);
    let mut random = Random(9);
    for _ in 0..200 {
        let mut bytes = whole.clone();
        let at = random.below(bytes.len() as u64) as usize;
        bytes[at] ^= 1 << random.below(8);
        assert!(Part::from_bytes(&bytes, &bricks.plan, 0).is_err(), "byte {at}");
        assert!(Part::head(&bytes, &bricks.plan, 0).is_err(), "byte {at}");
        bytes.truncate(at);
        assert!(Part::from_bytes(&bytes, &bricks.plan, 0).is_err(), "up to byte {at}");
    }
}

#[test]
fn a_real_volume_in_eight_bricks_is_right_everywhere() {
    let folder = std::env::var_os("ISOSPECTRUM_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if !folder.is_dir() {
        eprintln!("NOT RUN: nucleon: no folder {} (set ISOSPECTRUM_DATA)", folder.display());
        return;
    }
    let path = folder.join("nucleon_41x41x41_uint8.raw");
    let volume = read_volume(&path, &Default::default()).expect("nucleon");
    let bricks = Bricks::of(volume, 20, Some((20.0, 200.0)));
    assert_eq!(bricks.blocks.len(), 8);
    check("nucleon", &bricks, 64);
}

const PLAN: [&str; 7] = ["plan", "--phantom", "noise:17:4", "--brick", "8", "-o", "p.json"];
const PARTS: [&str; 7] = ["compute", "--backend", "cpu", "-q", "--plan", "p.json", "--parts"];

#[test]
fn the_bytes_are_the_same_whoever_computes_which_part_when() {
    let folder = Folder::new();
    folder.run(&PLAN);
    folder.run(&[&PARTS[..], &["0:7"]].concat());
    folder.run(&["merge", "p.json", "-o", "one.isp", "-q"]);
    // Two processes at once, the later half first, some parts by both.
    let script = r#""$0" compute --backend cpu -q --plan p.json --parts 3:7 -o two & "$0" compute --backend cpu --threads 1 -q --plan p.json --parts 0:4 -o two; wait"#;
    assert!(folder.shell(script).status.success());
    folder.run(&["merge", "p.json", "--parts", "two", "-o", "two.isp", "-q"]);
    assert_eq!(folder.read("one.isp"), folder.read("two.isp"));
    // Nothing is done twice.
    let said = stderr(&folder.run(&["compute", "--backend", "cpu", "--plan", "p.json"]));
    assert_eq!(said.matches("is there").count(), 8, "{said}");
    let verify = ["verify", "one.isp", "--phantom", "noise:17:4", "--n", "8"];
    folder.run(&verify);
}

#[test]
fn a_killed_worker_and_a_damaged_part_are_made_up_for() {
    let folder = Folder::new();
    folder.run(&PLAN);
    folder.run(&[&PARTS[..], &["0:7"]].concat());
    folder.run(&["merge", "p.json", "-o", "whole.isp", "-q"]);
    // Killed as soon as the first part is there.
    let script = r#""$0" compute --backend cpu -q --plan p.json -o parts & worker=$!
        while [ ! -e parts/000000.part ]; do sleep 0.01; done; kill -9 $worker; wait $worker; true"#;
    assert!(folder.shell(script).status.success());
    let merge = ["merge", "p.json", "--parts", "parts", "-o", "m.isp"];
    let told = folder.fails(&merge, 3);
    assert!(told.contains("of 8 parts are missing") && told.contains("expected them in"), "{told}");
    folder.run(&[&PARTS[..], &["0:7", "-o", "parts"]].concat());
    let part = folder.path().join("parts/000005.part");
    let mut bytes = std::fs::read(&part).expect("a part");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 16;
    std::fs::write(&part, bytes).expect("damaged");
    let told = folder.fails(&merge, 3);
    assert!(told.contains("000005.part") && told.contains("damaged"), "{told}");
    let anew = ["compute", "--backend", "cpu", "--plan", "p.json", "--parts", "5", "-o", "parts"];
    let said = stderr(&folder.run(&anew));
    assert!(said.contains("made anew"), "{said}");
    folder.run(&merge);
    assert_eq!(folder.read("m.isp"), folder.read("whole.isp"));
}

#[test]
fn what_is_wrong_with_a_plan_is_one_line() {
    let folder = Folder::new();
    folder.run(&PLAN);
    let told = folder.fails(&[&PARTS[..], &["3:8"]].concat(), 2);
    assert!(told.contains("part 8, expected 0 to 7"), "{told}");
    let told = folder.fails(&["plan", "--phantom", "blobs:9", "--brick", "3", "-o", "q.json"], 2);
    assert!(told.contains("bricks of 3 cells, expected 4 or more"), "{told}");
    let start = ["--start", "0.4", "--initial-mesh", "m.ply", "-o", "q.json"];
    let initial = [&["plan", "--phantom", "blobs:9"][..], &start].concat();
    assert!(folder.fails(&initial, 2).contains("an initial mesh is one of the whole volume"));
    let changed = String::from_utf8(folder.read("p.json")).expect("text");
    folder.write("p.json", changed.replace("\"error\": 0.1", "\"error\": 0.2").as_bytes());
    assert!(folder.fails(&[&PARTS[..], &["0"]].concat(), 3).contains("the plan was changed"));
    folder.write("p.json", b"{}");
    let told = folder.fails(&["merge", "p.json", "-o", "m.isp"], 3);
    assert!(told.contains("p.json: no plan of this version"), "{told}");
}
