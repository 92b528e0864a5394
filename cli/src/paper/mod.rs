//! `taut paper`: recomputes Sollmann & Jouaneh (2011).
#![allow(dead_code)]

mod belt;
mod claims;
mod findings;
mod linear;
mod model;
mod studies;

pub fn scratch() -> taut::Result<()> {
    let t = std::time::Instant::now();
    let f = findings::Findings::new()?;
    println!("{:?}", t.elapsed());
    for s in &f.belt.stiffness { println!("{} {} {} {:.2} {:.2} {:.2}", s.table, s.symbol, s.printed, s.lengths, s.inches, s.unrounded); }
    let b = &f.belt;
    println!("{} {} {} {} {} {} {} {}", b.composite, b.radius, b.thickness, b.cylinder_length, b.belt_wide_inertia, b.mass, b.mass_share, b.neoprene_teeth);
    for s in &f.identifiability.sharing { println!("{} {:?} {:?} {:?}", s.name, s.difference, s.adjusted, s.adjustment); }
    let i = &f.identifiability;
    println!("{} {} {:?} {:?} {} {} {}", i.scaled, i.count, i.geared, i.breakaway, i.below_breakaway, i.total_viscous, i.total_coulomb);
    let l = &f.linear;
    println!("{:?} {:?} {:?} {:?} {} {} {} {} {}", l.modes, l.slow, l.printed_pole, l.corrected_pole, l.printed_end, l.corrected_x3, l.corrected_end, l.by_exponential, l.closed_form);
    println!("{:?}", l.travel.first());
    let m = &f.matched;
    println!("{:?} {:?} {:?} {} {} {:?}", m.final_position, m.speed, m.ratio, m.scaled_to_5, m.scaled_to_10, m.table1);
    println!("creep {} {:?}", f.table3.exact_creep, f.table3.start);
    for (n, r) in [("t1", &f.runs.table1), ("t2", &f.runs.table2), ("t4", &f.runs.table4)] { println!("{n} tau {} cartv.24 {:.11}", r[0].time_constant(), r[0].cart_speed[r[0].row(0.24)]); }
    for e in &f.runs.effects { println!("{:?} {} x{} {}V tau {:+.4}% {:.6} osc {:+.3}", e.from, e.change.name(), e.factor, e.volts, 100.0*e.time_constant_change, e.time_constant, 100.0*e.oscillation); }
    Ok(())
}
