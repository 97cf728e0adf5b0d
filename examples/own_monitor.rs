//! A monitor of one's own: a geofence beside the built-in monitors, judged on the plant's truth.
//!
//! `cargo run --release -p examples --bin own_monitor`

use glam::DVec3;
use sim::guarantee::verdict::Extreme;
use sim::guarantee::{Guarantees, Monitor, Requirement, Verdict};
use sim::observer::Observer;
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

/// A box that the vehicle must not leave.
#[derive(Debug)]
struct Geofence {
    centre_world: DVec3,
    half_extent: DVec3,
    /// Least distance to the nearest wall so far, negative outside (m).
    nearest: Extreme,
}

impl Geofence {
    fn new(centre_world: DVec3, half_extent: DVec3) -> Self {
        Self { centre_world, half_extent, nearest: Extreme::default() }
    }
}

impl Observer for Geofence {
    fn observe(&mut self, tick: &Tick) {
        let offset = (tick.truth.position_world - self.centre_world).abs();
        self.nearest.lowest((self.half_extent - offset).min_element(), tick.time);
    }
}

impl Monitor for Geofence {
    fn verdicts(&self) -> Vec<Verdict> {
        let names = ("distance to the geofence", "-", "m");
        vec![Verdict::new(names, Requirement::AtLeast(0.0), self.nearest)]
    }
}

/// Flies the figure of eight inside a box of the given half extent (m).
fn fly(half_extent: DVec3) -> Result<Guarantees, Box<dyn std::error::Error>> {
    let loaded = LoadedScenario::open("lemniscate", &[])?;
    let scenario = loaded.scenario();
    let fence = Geofence::new(DVec3::new(0.0, 0.0, 4.0), half_extent);
    let mut guarantees = scenario.monitors().with(fence);
    loaded.flight()?.observe(scenario.ticks(), &mut guarantees);
    Ok(guarantees)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wide = fly(DVec3::new(5.0, 3.0, 3.0))?.verdicts();
    for verdict in &wide {
        println!("{verdict}");
    }
    assert!(
        wide.iter().all(|verdict| verdict.pass),
        "the flight stays inside, and every bound holds"
    );

    // The figure of eight is 8 m long: it leaves a box of 6 m, and nothing but the fence fails.
    let narrow = fly(DVec3::new(3.0, 3.0, 3.0))?.verdicts();
    let failed: Vec<_> = narrow.iter().filter(|it| !it.pass).map(|it| it.name).collect();
    assert_eq!(failed, ["distance to the geofence"]);
    Ok(())
}
