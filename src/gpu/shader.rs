//! The kernels and the files that each is concatenated from, shared ones first. WGSL has no imports, and one level of sharing
//! needs no preprocessor.

/// The text of one kernel.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Name of the kernel: its file, its entry point, its label.
    pub name: &'static str,
    /// The texts that are concatenated.
    parts: &'static [&'static str],
}

impl Shader {
    /// The whole text.
    pub fn text(&self) -> String {
        self.parts.concat()
    }
}

const DISPATCH: &str = include_str!("../../shaders/dispatch.wgsl");
const MESH: &str = include_str!("../../shaders/mesh.wgsl");
const GRID: &str = include_str!("../../shaders/grid.wgsl");
const RAY: &str = include_str!("../../shaders/ray.wgsl");
const STEP: &str = include_str!("../../shaders/step.wgsl");

/// Area-weighted normals.
pub const NORMALS: Shader = Shader {
    name: "normals",
    parts: &[DISPATCH, MESH, include_str!("../../shaders/normals.wgsl")],
};

/// Vertices onto the isosurface.
pub const PROJECT: Shader = Shader {
    name: "project",
    parts: &[DISPATCH, MESH, GRID, RAY, STEP, include_str!("../../shaders/project.wgsl")],
};

/// One iteration of relaxation.
pub const RELAX: Shader = Shader {
    name: "relax",
    parts: &[DISPATCH, MESH, GRID, RAY, STEP, include_str!("../../shaders/relax.wgsl")],
};

/// Distances of barycentres from the isosurface.
pub const DEVIATION: Shader = Shader {
    name: "deviation",
    parts: &[DISPATCH, MESH, GRID, RAY, include_str!("../../shaders/deviation.wgsl")],
};

/// The largest force.
pub const REDUCE: Shader =
    Shader { name: "reduce", parts: &[DISPATCH, include_str!("../../shaders/reduce.wgsl")] };

/// All kernels.
pub const ALL: [Shader; 5] = [NORMALS, PROJECT, RELAX, DEVIATION, REDUCE];
