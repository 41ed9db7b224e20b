//! The triangle mesh at one isovalue.

/// The mesh at one isovalue.
///
/// ```
/// use isospectrum::volume::phantom;
/// use isospectrum::{Backend, Choice, Parameters, Silent, compute, export};
///
/// let volume = std::sync::Arc::new(phantom("sphere:10")?);
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent)?;
/// let mesh = spectrum.mesh_at(0.4)?;
/// assert_eq!((mesh.normals.len(), mesh.caps.len()), (mesh.positions.len(), mesh.triangles.len()));
/// // Positions in the world.
/// let placed = export::place_in_world(mesh.clone(), volume.placement());
/// assert_eq!(placed.triangles, mesh.triangles);
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions, voxel frame (exports place them in the world).
    pub positions: Vec<[f32; 3]>,
    /// Unit normals towards the outer side ([`Outside`](crate::volume::Outside)): area-weighted means over the triangles around each vertex, over caps only
    /// if it has no others.
    pub normals: Vec<[f32; 3]>,
    /// Vertex indices, counter-clockwise seen from the outer side.
    pub triangles: Vec<[u32; 3]>,
    /// Whether a triangle is a cap; as long as `triangles`.
    pub caps: Vec<bool>,
}

impl Mesh {
    /// Lower and upper corner of the bounding box, voxel frame; none of an empty mesh.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let (first, others) = self.positions.split_first()?;
        let start = [*first, *first];
        let [low, high] = others.iter().fold(start, |[low, high], p| {
            let along = |axis: usize| (low[axis].min(p[axis]), high[axis].max(p[axis]));
            let sides: [_; 3] = std::array::from_fn(along);
            [sides.map(|s| s.0), sides.map(|s| s.1)]
        });
        Some([low, high].map(|corner| corner.map(f64::from)))
    }
}
