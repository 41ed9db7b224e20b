//! `extract`: the mesh at one isovalue, as a file of another program's format.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;
use isospectrum::Error;
use isospectrum::export::{self, Format};
use isospectrum::spectrum::SurfaceMesh;
use serde::Serialize;

use super::isovalue::Isovalue;
use super::output::Output;
use super::{report, spectrum_file};

/// Write the mesh at one isovalue
#[derive(Args, Debug)]
pub(super) struct Extract {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: a number, or a percentage of the range such as 50%
    #[arg(short = 'c', long, value_name = "C", allow_hyphen_values = true)]
    isovalue: Isovalue,
    /// Mesh to write: .ply, .stl, .obj or .glb; - is stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Format, where the name does not tell: ply, stl, obj or glb
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Leave out the triangles that close the mesh at the border of the volume
    #[arg(long)]
    open: bool,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
}

/// The `extract` report.
#[derive(Serialize)]
struct Extracted {
    isovalue: f64,
    n_vertices: usize,
    n_triangles: usize,
    bytes: u64,
}

impl Extract {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let format = self.format()?;
        let output = Output::open(&self.output)?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let (spectrum, _) = spectrum_file::read(&self.spectrum)?;
        let isovalue = self.isovalue.in_range(spectrum.range);
        let mut mesh = spectrum.mesh_at(isovalue).context("extract")?;
        if self.open {
            mesh = without_caps(&mesh);
        }
        if mesh.triangles.is_empty() {
            log::warn!("{}", why_empty(isovalue, spectrum.range, self.open));
        }
        let bytes = output.write(|file| export::write(&mesh, &spectrum.volume, format, file))?;
        let (n_vertices, n_triangles) = (mesh.positions.len(), mesh.triangles.len());
        if self.json {
            report::print_json("extract", &Extracted { isovalue, n_vertices, n_triangles, bytes })?;
        }
        log::info!(
            "{}: {n_triangles} triangles, {n_vertices} vertices at isovalue {isovalue}, {}",
            self.output.display(),
            report::bytes(bytes)
        );
        Ok(())
    }

    fn format(&self) -> isospectrum::Result<Format> {
        match &self.format {
            Some(name) => Format::from_extension(name),
            // Other programs read PLY from a pipe.
            None if self.output.as_os_str() == "-" => Format::from_extension("ply"),
            None => {
                let extension = self.output.extension().unwrap_or_default().to_string_lossy();
                Format::from_extension(&extension)
            }
        }
    }
}

/// The mesh as it ends at the border of the volume: without caps and the vertices only they use.
fn without_caps(mesh: &SurfaceMesh) -> SurfaceMesh {
    let mut open = SurfaceMesh::default();
    let mut new_index = vec![u32::MAX; mesh.positions.len()];
    for (triangle, _) in mesh.triangles.iter().zip(&mesh.caps).filter(|(_, cap)| !**cap) {
        open.triangles.push(triangle.map(|v| {
            let index = &mut new_index[v as usize];
            if *index == u32::MAX {
                *index = open.positions.len() as u32;
                open.positions.push(mesh.positions[v as usize]);
                open.normals.push(mesh.normals[v as usize]);
            }
            *index
        }));
        open.caps.push(false);
    }
    open
}

/// What to say where there is no surface.
fn why_empty(isovalue: f64, (low, high): (f64, f64), open: bool) -> String {
    let place = if isovalue == low || isovalue == high {
        "it is an end of the range, where the surface has not appeared yet or is gone"
    } else if open {
        "without the caps nothing of the surface is inside the volume"
    } else {
        "no sample is on one side of it"
    };
    format!(
        "the surface at isovalue {isovalue} is empty: {place}; the range is {low} to {high}, try 50%"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_mesh_has_no_caps_and_no_vertex_of_caps_alone() {
        let mesh = SurfaceMesh {
            positions: vec![[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            triangles: vec![[0, 1, 2], [3, 2, 1]],
            caps: vec![true, false],
        };
        let open = without_caps(&mesh);
        assert_eq!(open.positions, [[3.0; 3], [2.0; 3], [1.0; 3]]);
        assert_eq!(open.triangles, [[0, 1, 2]]);
        assert_eq!((open.caps.len(), open.normals.len()), (1, 3));
    }
}
