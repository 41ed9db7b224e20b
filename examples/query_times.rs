//! Query times of a spectrum, as JSON for `benches/peers/vtk_flying_edges.py`:
//! `query_times S.isp`.
//!
//! It reads isovalues from stdin, one a line, and prints one line for each: nanoseconds
//! for the list of active triangles, nanoseconds for the mesh with normals, and the number
//! of triangles. So another program can alternate with it, and both run under the same load.

use std::io::{BufRead as _, Write as _, stdin, stdout};
use std::time::Instant;

use isospectrum::spectrum::{Mesh, Query};
use isospectrum::unstable::spectrum::ActiveSet;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected the name of a spectrum")?;
    let spectrum = isospectrum::file::read(&path)?;
    let mut list = ActiveSet::new(spectrum.triangles());
    let mut query = Query::new(&spectrum);
    let mut mesh = Mesh::default();
    let (low, high) = spectrum.range();
    println!("{{\"range\": [{low}, {high}], \"n_triangles\": {}}}", spectrum.triangles().len());
    for line in stdin().lock().lines() {
        let isovalue: f64 = line?.trim().parse()?;
        let started = Instant::now();
        let n_listed = match spectrum.rank_at(isovalue) {
            Some(rank) => list.move_to(rank).len(),
            None => 0,
        };
        let list_ns = started.elapsed().as_nanos();
        let started = Instant::now();
        query.mesh_at_into(isovalue, &mut mesh)?;
        let mesh_ns = started.elapsed().as_nanos();
        if mesh.triangles.len() != n_listed {
            return Err(format!("{n_listed} listed, {} in the mesh", mesh.triangles.len()).into());
        }
        println!("{{\"list_ns\": {list_ns}, \"mesh_ns\": {mesh_ns}, \"n_triangles\": {n_listed}}}");
        stdout().flush()?;
    }
    Ok(())
}
