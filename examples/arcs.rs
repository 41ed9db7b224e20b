use isospectrum::{topology::{Topology, exact::ExactField}, volume::*};
fn main(){ let v = match std::env::args().nth(1).unwrap().as_str() { s if s.contains('.') => read_volume(std::path::Path::new(s), &ReadOptions::default()).unwrap(), s => phantom::phantom(s).unwrap() };
 let t=std::time::Instant::now(); let e=ExactField::new(&v).unwrap(); let tp=Topology::compute(&e).unwrap();
 let pos: Vec<_>=tp.arcs.iter().filter(|a|a.birth<a.death && a.death>v.range().0).collect();
 let mut ev: Vec<f64>=tp.events.iter().map(|e|e.isovalue).collect(); ev.sort_by(f64::total_cmp); ev.dedup();
 println!("{} {:?} events {} arcs {} lasting {} distinct isovalues {}", v.name(), t.elapsed(), tp.events.len(), tp.arcs.len(), pos.len(), ev.len());
 let mut l: Vec<f64>=pos.iter().map(|a|a.death-a.birth.max(v.range().0)).collect(); l.sort_by(f64::total_cmp);
 println!("lengths {:?}", [0,1,2,3,4,5,6,7,8,9].map(|i| l[(l.len()-1)*i/9]));
}
