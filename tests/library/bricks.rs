//! Bricks: parts that are swept separately fit together. See `docs/decisions/0004-bricks.md`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use crate::common::program::Folder;
use crate::common::random::Random;
use crate::common::spectra::{assert_isosurfaces, cpu, in_grey_levels, random_isovalues};
use isospectrum::bricks::{
    OpenVolume, Part, Parts, Plan, Survey, VolumeSource, merge, merge_to_path,
};
use isospectrum::spectrum::Spectrum;
use isospectrum::unstable::sweep::{Block, compute_block};
use isospectrum::unstable::topology::Topology;
use isospectrum::unstable::topology::blocks::BlockTopology;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::{
    Outside, Placement, Preparation, ReadOptions, Samples, Volume, phantom, read_volume,
};
use isospectrum::{Cleaned, Noise, Prepared};
use isospectrum::{Parameters, Silent};

/// A volume in bricks: its plan and the sweep of each brick.
struct Bricks {
    volume: Arc<Volume>,
    opened: OpenVolume,
    plan: Plan,
    blocks: Vec<Block>,
    topologies: Vec<BlockTopology>,
}

impl Bricks {
    fn of(volume: Volume, side: usize, range: Option<(f64, f64)>) -> Bricks {
        let prepared = Prepared::of(volume, Preparation::default(), Cleaned::default());
        let volume = prepared.volume().clone();
        // The samples are in memory already.
        let source = VolumeSource::Phantom { name: "-".to_owned(), outside: volume.outside() };
        let parameters = Parameters::default().with_range(range);
        let survey = Survey::of(prepared);
        let plan = Plan::new(source, &survey, Noise::default(), &parameters, side);
        let plan = plan.expect("a plan");
        let opened = survey.volume().clone();
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
        let (block, topology) = (&self.blocks[number], &self.topologies[number]);
        Part::to_bytes(&self.plan, number, "cpu", block, topology).expect("packed")
    }

    /// The files of all parts, in a folder.
    fn parts(&self, folder: &Path) -> Parts<'_> {
        let parts = Parts::new(&self.plan, folder);
        for number in 0..self.blocks.len() {
            std::fs::write(parts.file(number), self.part(number)).expect("written");
        }
        parts
    }

    fn merged(&self) -> Spectrum {
        let folder = Folder::new();
        merge(&self.parts(folder.path()), &self.opened, &Silent).expect("parts that fit")
    }
}

/// A volume cut to other dimensions.
fn cropped(name: &str, dims: [usize; 3]) -> Volume {
    let crop = Some(dims.map(|n| [0, n]));
    let preparation = Preparation { crop, ..Preparation::default() };
    preparation.apply(phantom(name).expect("a phantom")).expect("inside")
}

/// Checks that the mesh is closed at all isovalues and has the counted topology, and that events are those of the whole.
fn check(name: &str, bricks: &Bricks, n: usize) -> Spectrum {
    let spectrum = bricks.merged();
    let volume = &bricks.volume;
    let field = ExactField::new(volume).expect("a field");
    let mut at = random_isovalues(spectrum.range(), n, 30);
    // At values of samples.
    let samples = random_isovalues(spectrum.range(), n / 4, 31);
    at.extend(samples.iter().map(|c| c.round()).filter(|_| volume.samples().is_integer()));
    assert_isosurfaces(volume, &spectrum, &at, name);
    let topology = Topology::compute(&field).expect("a topology");
    let (low, high) = spectrum.range();
    let inside = topology.net_events().into_iter().filter(|e| (low..=high).contains(&e.isovalue));
    assert_eq!(spectrum.events(), inside.collect::<Vec<_>>(), "{name}");
    spectrum
}

#[test]
fn the_merged_mesh_is_closed_and_right_at_random_isovalues() {
    check_merged("noise 2x2x2", cropped("noise:17:301", [13, 12, 13]), 6, 24);
    check_merged("levels 3x1x2", in_grey_levels(&cropped("noise:25:8", [19, 6, 13]), 40.0), 6, 24);
    check_merged("high 2x2x2", turned_gyroid(13), 6, 24);
}

/// A gyroid outside which samples are high.
fn turned_gyroid(side: usize) -> Volume {
    phantom(&format!("gyroid:{side}")).expect("a phantom").with_outside(Outside::High)
}

fn check_merged(name: &str, volume: Volume, side: usize, n_isovalues: usize) {
    let bricks = Bricks::of(volume, side, None);
    assert!(bricks.blocks.len() >= 6, "{name}: {} bricks", bricks.blocks.len());
    let spectrum = check(name, &bricks, n_isovalues);
    let n_tracked: f64 = bricks.blocks.iter().flat_map(|b| &b.areas).map(|a| a[0]).sum();
    assert!(n_tracked > 0.0 && spectrum.triangles().len() > 1000, "{name}: nothing is tracked");
}

mod long {
    use super::*;

    #[test]
    #[ignore = "long: run by scripts/test --long"]
    fn the_merged_mesh_of_larger_bricks_is_closed_and_right_at_random_isovalues() {
        for (name, volume) in [
            ("noise 2x2x2", cropped("noise:17:301", [17, 16, 17])),
            ("noise 3x1x2", cropped("noise:25:7", [25, 9, 17])),
            ("levels 2x2x2", in_grey_levels(&cropped("noise:17:302", [16, 17, 15]), 12.0)),
            ("levels 3x1x2", in_grey_levels(&cropped("noise:25:8", [25, 8, 17]), 40.0)),
            ("high 2x2x2", turned_gyroid(17)),
        ] {
            check_merged(name, volume, 8, 48);
        }
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
    assert_eq!(spectrum.range(), range);
}

/// Trajectories at the vertices of shared planes, by lattice edge.
type Seam = BTreeMap<u64, Vec<(f64, [f32; 3])>>;

fn seam(block: &Block) -> Seam {
    let s = &block.spectrum;
    let knots = |v: u32| {
        let all = s.trajectory(v).iter();
        all.map(|k| (s.isovalues()[k.rank as usize], k.position)).collect()
    };
    block.shared.iter().map(|&(v, edge)| (edge, knots(v))).collect()
}

#[test]
fn both_sides_of_a_shared_plane_have_the_same_vertices_and_trajectories() {
    // Two bricks: everything on the shared plane belongs to both.
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
fn a_plan_by_slabs_is_the_plan_of_the_volume_read_as_a_whole() {
    let folder = Folder::new();
    let wide = cropped("noise:60:5", [60, 23, 31]);
    let levels = in_grey_levels(&cropped("noise:17:4", [9, 17, 12]), 200.0);
    let shorts = (0..2 * 2 * 2).map(|i| 1000 * i - 3000).collect::<Vec<i16>>();
    let small = Volume::new("s", [2; 3], shorts.into(), Placement::default()).expect("a volume");
    for (volume, side) in [(wide, 8), (levels, 5), (small, 4)] {
        let ([x, y, z], kind) = (volume.dims(), volume.samples().type_name());
        let name = format!("v_{x}x{y}x{z}_{kind}.raw");
        folder.write(&name, &volume.samples().to_le_bytes());
        let path = folder.path().join(&name);
        let options = ReadOptions { spacing: Some([0.5, 1.0, 2.0]), ..ReadOptions::default() };
        let whole = read_volume(&path, &options).expect("a volume").with_outside(Outside::High);
        let whole = Survey::of(Prepared::of(whole, Preparation::default(), Cleaned::default()));
        let source =
            VolumeSource::File { path, options: Box::new(options), outside: Outside::High };
        let slabs = Survey::of_file(&source).expect("readable").expect("plain samples");
        let plan = |survey: &Survey| {
            let parameters = Parameters::default();
            Plan::new(source.clone(), survey, Noise::default(), &parameters, side).expect("a plan")
        };
        assert!(matches!(slabs.volume(), OpenVolume::Slabs(..)));
        assert_eq!(plan(&slabs), plan(&whole), "{name}");
    }
}

#[test]
fn a_sample_that_is_no_number_is_named_by_slabs_too() {
    let folder = Folder::new();
    let mut samples = vec![0.5f32; 5 * 4 * 3];
    (samples[0], samples[5 * 4 + 7]) = (0.0, f32::NAN);
    let bytes: Vec<u8> = samples.iter().flat_map(|x| x.to_le_bytes()).collect();
    folder.write("v_5x4x3_float32.raw", &bytes);
    let plan = ["plan", "v_5x4x3_float32.raw", "-o", "p.json"];
    assert!(folder.fails(&plan, 3).contains("(2, 1, 1) is NaN"));
    folder.run(&[&plan[..], &["--nan-as", "0.25"]].concat());
    folder.write("v_5x4x3_float32.raw", &bytes[..90]);
    assert!(folder.fails(&plan, 3).contains("90 bytes, expected 240"));
    folder.write("v_5x4x3_float32.raw", &[&bytes[..], b"more"].concat());
    assert!(folder.fails(&plan, 3).contains("244 bytes, expected 240"));
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
    // With equal hashes, the sides of the parts would not match.
    let forged = Bricks { blocks: vec![a.blocks[0].clone(), b.blocks[1].clone()], ..a };
    let folder = Folder::new();
    let parts = forged.parts(folder.path());
    let refused = merge(&parts, &forged.opened, &Silent).expect_err("sides that differ");
    assert!(refused.to_string().contains("has another vertex"), "{refused}");
    let made = folder.path().join("made.isp");
    let refused = merge_to_path(&parts, &forged.opened, &made, None, &Silent);
    let refused = refused.expect_err("sides that differ").to_string();
    assert!(refused.contains("has another vertex"), "{refused}");
}

#[test]
fn every_damaged_byte_of_a_part_is_an_error() {
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

mod real_volumes {
    use super::*;
    use crate::common::data;

    #[test]
    #[ignore = "needs $ISOSPECTRUM_DATA: run by scripts/test"]
    fn a_real_volume_in_eight_bricks_is_right_everywhere() {
        let path = data::file("nucleon_41x41x41_uint8.raw");
        let volume = read_volume(&path, &Default::default()).expect("nucleon");
        let bricks = Bricks::of(volume, 20, Some((20.0, 200.0)));
        assert_eq!(bricks.blocks.len(), 8);
        check("nucleon", &bricks, 64);
    }
}
