//! Shapes whose pictures are known, and where their points appear in a picture.

use std::sync::OnceLock;

use isospectrum::render::Gpu;
use isospectrum::render::{BORDER, Background, Camera, FIELD_OF_VIEW, FILL, Image, Renderer, View};
use isospectrum::spectrum::{About, Knot, Patch, Spectrum, Triangle, VolumeInfo};
use isospectrum::volume::{Outside, Placement};

/// Maximum distance of the outline of a drawn shape from that of the shape, pixels: an outline is known
/// to the spacing of the four samples of a pixel, which is half a pixel at worst.
pub(crate) const OUTLINE_TOLERANCE: f64 = 0.5;

/// Maximum distance of the middle of a small drawn shape from that of the shape, pixels. Errors of the
/// outline average out over its length; a marker's outline crosses about twenty pixels, each wrong
/// by at most 0.5, on either side: 0.5 / sqrt(20), doubled.
pub(crate) const MIDDLE_TOLERANCE: f64 = 0.23;

pub(crate) fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(open)
}

pub(crate) fn open() -> Gpu {
    Gpu::new(None).unwrap_or_else(|error| {
        panic!("{error}; the tests of the renderer need an adapter: install mesa-vulkan-drivers")
    })
}

/// A closed mesh: positions and faces, counter-clockwise from outside.
pub(crate) type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

pub(crate) fn octahedron() -> Mesh {
    let positions = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
        .map(|p| p.map(f64::from));
    let faces =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    (positions.to_vec(), faces.to_vec())
}

/// A unit sphere: an octahedron whose faces are split in four `n` times.
pub(crate) fn sphere(n: u32) -> Mesh {
    let (mut positions, mut faces) = octahedron();
    for _ in 0..n {
        let mut middles = std::collections::BTreeMap::new();
        let mut split = Vec::new();
        for [a, b, c] in faces {
            let mut middle = |v: u32, w: u32| {
                *middles.entry((v.min(w), v.max(w))).or_insert_with(|| {
                    let (p, q) = (positions[v as usize], positions[w as usize]);
                    positions.push(unit([p[0] + q[0], p[1] + q[1], p[2] + q[2]]));
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = split;
    }
    (positions, faces)
}

pub(crate) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn empty(
    placement: Placement,
    dims: [usize; 3],
    isovalues: Vec<f64>,
    range: (f64, f64),
) -> Spectrum {
    let info = VolumeInfo {
        name: "synthetic".into(),
        dims,
        sample_type: "float32".into(),
        range,
        placement,
        outside: Outside::Low,
    };
    let patch = Patch { isovalues, first_knot: vec![0], ..Patch::default() };
    Spectrum::new(About::new(info, range, 0.1), patch).expect("valid")
}

/// Adds a mesh that lives from the first rank to the last, scaled and moved at each rank.
pub(crate) fn add(spectrum: &mut Spectrum, (positions, faces): &Mesh, at: &[(u32, f64, [f64; 3])]) {
    let first = spectrum.n_vertices() as u32;
    let (birth, death) = (at[0].0, at[at.len() - 1].0);
    let added = spectrum.clone().changed(|_, patch| {
        for &p in positions {
            for &(rank, radius, middle) in at {
                patch.knots.push(Knot {
                    rank,
                    position: std::array::from_fn(|i| (middle[i] + radius * p[i]) as f32),
                });
            }
            patch.first_knot.push(patch.knots.len() as u32);
        }
        patch.triangles.extend(faces.iter().map(|face| Triangle {
            vertices: face.map(|v| first + v),
            birth,
            death,
            cap: false,
        }));
    });
    *spectrum = added.expect("valid");
}

/// Middle of the volume of [`growing_sphere`].
pub(crate) const MIDDLE: [f64; 3] = [10.0; 3];

/// A sphere in the middle of 21^3 samples with radius 3 at isovalue 0 and 9 at isovalue 1.
pub(crate) fn growing_sphere(n_splits: u32) -> Spectrum {
    let mut spectrum = empty(Placement::default(), [21; 3], vec![0.0, 2.0], (0.0, 1.0));
    add(&mut spectrum, &sphere(n_splits), &[(0, 3.0, MIDDLE), (1, 15.0, MIDDLE)]);
    spectrum.check().expect("a valid spectrum");
    spectrum
}

pub(crate) fn radius_at(isovalue: f64) -> f64 {
    3.0 + 6.0 * isovalue
}

pub(crate) fn small(camera: &str) -> View {
    View::default()
        .with_camera(camera.parse().expect("a camera"))
        .with_width(320)
        .with_height(240)
        .with_background(Background::Transparent)
}

/// A view in parallel projection.
pub(crate) fn parallel(view: View) -> View {
    let camera = Camera { orthographic: true, ..view.camera };
    view.with_camera(camera)
}

pub(crate) fn draw(spectrum: &Spectrum, isovalue: f64, view: &View) -> Image {
    let mut renderer = Renderer::new(gpu(), spectrum).expect("a renderer");
    renderer.draw(isovalue, view).expect("a picture")
}

/// Covered area in pixels and its middle.
pub(crate) fn coverage(image: &Image) -> (f64, [f64; 2]) {
    let (mut area, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
    for y in 0..image.height {
        for x in 0..image.width {
            let alpha = f64::from(image.pixel(x, y)[3]) / 255.0;
            area += alpha;
            x_sum += alpha * (f64::from(x) + 0.5);
            y_sum += alpha * (f64::from(y) + 0.5);
        }
    }
    (area, [x_sum / area, y_sum / area])
}

/// The position of a point of the voxel frame in the picture, pixels from the top left, and its depth in front of the
/// eye, voxels: from the documentation of the camera, without matrices.
pub(crate) fn project(volume: &VolumeInfo, view: &View, p: [f64; 3]) -> ([f64; 2], f64) {
    let Camera { azimuth, elevation, distance, orthographic, up: _ } = view.camera;
    let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = elevation.to_radians().sin_cos();
    let right = [-sin_a, cos_a, 0.0];
    let up = [-sin_e * cos_a, -sin_e * sin_a, cos_e];
    let towards_eye = [cos_e * cos_a, cos_e * sin_a, sin_e];

    let Placement { spacing, direction, .. } = volume.placement;
    let unit = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let world = |p: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| (0..3).map(|axis| direction[axis][i] * p[axis]).sum())
    };
    let box_corner = |side: [f64; 3]| -> [f64; 3] {
        world(std::array::from_fn(|a| {
            let last = volume.dims[a] as f64 - 1.0;
            spacing[a] / unit * (side[a] * (last + BORDER) - (1.0 - side[a]) * BORDER)
        }))
    };
    let middle = box_corner([0.5; 3]);
    let from_middle = |q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| q[i] - middle[i]) };
    let tan_y = (FIELD_OF_VIEW / 2.0).to_radians().tan();
    let (width, height) = (f64::from(view.width), f64::from(view.height));
    let tan_x = tan_y * width / height;
    let mut fit = 0f64;
    for corner in 0..8 {
        let side = [corner & 1, corner >> 1 & 1, corner >> 2].map(f64::from);
        let q = from_middle(box_corner(side));
        let needed = (dot(q, right).abs() / tan_x).max(dot(q, up).abs() / tan_y) / FILL;
        fit = fit.max(needed + if orthographic { 0.0 } else { dot(q, towards_eye) });
    }
    let q = from_middle(world(p));
    let depth = distance * fit - dot(q, towards_eye);
    let shown_from = if orthographic { distance * fit } else { depth };
    let x = 0.5 * width * (1.0 + dot(q, right) / (shown_from * tan_x));
    let y = 0.5 * height * (1.0 - dot(q, up) / (shown_from * tan_y));
    ([x, y], depth)
}

/// Radius in pixels of the outline of a ball of radius `r` in the middle of the picture, whose
/// middle is `depth` in front of the eye: the cone that touches it.
pub(crate) fn outline_radius(view: &View, r: f64, depth: f64) -> f64 {
    let tan_y = (FIELD_OF_VIEW / 2.0).to_radians().tan();
    0.5 * f64::from(view.height) * r / (depth * depth - r * r).sqrt() / tan_y
}

pub(crate) fn brightness(pixel: [u8; 4]) -> i32 {
    pixel[..3].iter().map(|&c| i32::from(c)).sum()
}
