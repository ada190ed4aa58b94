//! A study of one's own: ten moves by five degrees, each of a motor that the seed draws, judged by the truth.
//!
//! `cargo run --release --example own_study`

use simulation::Scene;
use simulation::runs::position;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("seed  final error (mdeg)  settled after (s)");
    for seed in 1..=10 {
        let mut scene = Scene::default();
        scene.set("seed", &seed.to_string())?;
        scene.set("position.to_deg", "5")?;
        let outcome = position::run(&scene, |_moment| ())?;
        let settled = outcome.settle_time_s.map_or("-".to_owned(), |settle_s| format!("{settle_s:.2}"));
        println!("{seed:4}  {:+18.2}  {settled:>17}", outcome.final_error_mdeg);
    }
    Ok(())
}
