#[path = "../tests/generator/mod.rs"]
mod generator;
use generator::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let plant = match args[1].as_str() { "planar" => Plant::Planar, "force" => Plant::Force, "mass" => Plant::Mass, "motion" => Plant::Motion, _ => Plant::Wrist };
    let names = ["none", "coulomb-friction", "hysteresis", "cubic-stiffness", "asymmetric-stiffness", "dead-zone", "end-stop", "reflex-delay", "reflex-one", "extra-resonance", "viscoelastic", "stiffness-drift", "posture-drift", "measurement-delay", "channel-filter", "series-compliance"];
    let severity: f64 = args[2].parse().expect("severity");
    let other = args.get(4).is_some_and(|a| a == "other");
    for (k, name) in names.into_iter().enumerate() {
        if args.get(3).is_some_and(|a| a != "all" && a != name) { continue; }
        let hidden = if name == "none" { vec![] } else { vec![Hidden { name, severity }] };
        let made = make(&Case { plant, hidden, other, background: false, trials: 3, duration_s: 50.0, seed: 100 + k as u64 });
        println!("{name} axis {} {:?}", made.axis, made.truth);
        match ndof_diagnose::trace(&made.recordings, &made.ports, &Default::default()) {
            Ok(t) => print!("{t}"),
            Err(e) => println!("  error {e}"),
        }
    }
}
