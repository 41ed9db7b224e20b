//! 3MF, for 3D printing: a ZIP package with an XML model, in millimetres.

use std::io::{self, Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::world_mesh::WorldMesh;

const TYPES: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\n\
    <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\n\
    <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\n\
    </Types>\n";

const RELATIONS: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\n\
    <Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\n\
    </Relationships>\n";

/// Writes a mesh. World coordinates of an unknown unit are taken for millimetres.
pub(super) fn write(mesh: &WorldMesh, writer: &mut dyn Write) -> io::Result<()> {
    // A fixed date, so that equal meshes are equal files.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default());
    let mut package = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in [("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)] {
        package.start_file(name, options)?;
        package.write_all(text.as_bytes())?;
    }
    package.start_file("3D/3dmodel.model", options)?;
    let mut text = io::BufWriter::new(&mut package);
    write_model(mesh, &mut text)?;
    text.flush()?;
    drop(text);
    writer.write_all(package.finish()?.get_ref())
}

fn write_model(world_mesh: &WorldMesh, text: &mut dyn Write) -> io::Result<()> {
    let mm = world_mesh.placement.unit.in_mm().unwrap_or(1.0);
    write!(
        text,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <model unit=\"millimeter\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
         <metadata name=\"Application\">isospectrum {}</metadata>\n\
         <resources>\n",
        env!("CARGO_PKG_VERSION")
    )?;
    // A mesh needs at least three triangles, so an empty one becomes a model without objects.
    let is_empty = world_mesh.mesh.triangles.is_empty();
    if !is_empty {
        writeln!(text, "<object id=\"1\" type=\"model\">\n<mesh>\n<vertices>")?;
        for position in world_mesh.positions() {
            let [x, y, z] = position.map(|x| x * mm);
            if world_mesh.is_far {
                writeln!(text, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")?;
            } else {
                let [x, y, z] = [x, y, z].map(|x| x as f32);
                writeln!(text, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")?;
            }
        }
        writeln!(text, "</vertices>\n<triangles>")?;
        for [a, b, c] in &world_mesh.mesh.triangles {
            writeln!(text, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")?;
        }
        writeln!(text, "</triangles>\n</mesh>\n</object>")?;
    }
    let item = if is_empty { "" } else { "<item objectid=\"1\"/>\n" };
    writeln!(text, "</resources>\n<build>\n{item}</build>\n</model>")
}
