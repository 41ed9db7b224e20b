use isospectrum::{file, export, sweep::*, kernels::Backend, spectrum::Query, volume::*};
use std::{path::Path, sync::Arc};
struct P; impl Progress for P { fn report(&self, d: f64, m: &str) { if std::env::var("V").is_ok() { eprintln!("{:.1}% {m}", d*100.0); } } fn cancelled(&self)->bool{false} }
fn main(){ let a: Vec<String> = std::env::args().collect();
 match a[1].as_str() {
  "compute" => { let v = if a[2].contains('.') { read_volume(Path::new(&a[2]), &ReadOptions::default()).unwrap() } else { phantom(&a[2]).unwrap() };
    let mut p = Parameters::default();
    for x in &a { if let Some(s)=x.strip_prefix("step=") { p.step = Some(s.parse().unwrap()); } if let Some(s)=x.strip_prefix("range=") { let (l,h)=s.split_once(':').unwrap(); p.range=Some((l.parse().unwrap(),h.parse().unwrap())); } }
    let s = compute(&Arc::new(v), &p, &Backend::Cpu, &P).unwrap();
    eprintln!("vertices {} triangles {} knots {} isovalues {} events {} {}", s.n_vertices(), s.triangles.len(), s.knots.len(), s.isovalues.len(), s.events.len(), s.parameters["counts"]);
    file::write(&s, Path::new(&a[4])).unwrap(); }
  "extract" => { let s = file::read(Path::new(&a[2])).unwrap(); let c: f64 = a[4].parse().unwrap(); let mut q = Query::new(&s); let m = q.mesh_at(c).unwrap(); export::write(&m, &s.volume.placement, export::Border::Closed, Path::new(&a[6])).unwrap(); }
  _ => {} } }
