//! temporary
use taut::case::Opened;
use taut::export::fmu::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let v = if a[3] == "2" { Version::Two } else { Version::Three };
    let case = Opened::read_with(&a[1], &[]).unwrap();
    let model = Model::new(&case, a.len() > 5).unwrap();
    let mut z = Archive::new();
    z.add("modelDescription.xml", description(&model, v).unwrap().as_bytes()).unwrap();
    let (f, e) = platform(v).unwrap();
    z.add(&format!("binaries/{f}/taut_fmu.{e}"), &std::fs::read(&a[4]).unwrap()).unwrap();
    z.add(MACHINE, model.resource.as_bytes()).unwrap();
    std::fs::write(&a[2], z.finish().unwrap()).unwrap();
}
