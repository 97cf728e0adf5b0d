//! A disturbance of one's own: the drag of a wind that depends on the vehicle's motion, under controller 1
//! and every monitor of its theorem.
//!
//! `cargo run --release -p examples --bin own_disturbance`

use glam::DVec3;
use sim::plant::disturbance::DisturbanceSource;
use sim::plant::{Disturbance, PlantState};
use sim::scenario::LoadedScenario;

/// Quadratic drag in a wind that grows to its full strength.
struct Wind {
    /// Full strength, world frame (m/s).
    velocity_world: DVec3,
    /// Time in which the wind grows (s).
    growth: f64,
    /// Drag over mass (1/m).
    drag: f64,
    /// Bound of the acceleration, which Assumption 2 needs (m/s^2).
    acceleration_max: f64,
    step_period: f64,
    time: f64,
}

impl DisturbanceSource for Wind {
    fn advance(&mut self, truth: &PlantState) -> Disturbance {
        let strength = (self.time / self.growth).min(1.0);
        self.time += self.step_period;
        let relative = strength * self.velocity_world - truth.velocity_world;
        let acceleration = self.drag * relative.length() * relative;
        Disturbance {
            acceleration_world: acceleration.clamp_length_max(self.acceleration_max),
            ..Disturbance::NONE
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = LoadedScenario::open("hover-gusts", &["guarantees.settle_time=40.0".to_owned()])?;
    let scenario = loaded.scenario();
    let controller = &scenario.controller;
    let wind = Wind {
        velocity_world: DVec3::new(3.0, -2.0, 0.5),
        growth: 10.0,
        drag: 0.03,
        acceleration_max: controller.uncertainty().disturbance_acceleration.into(),
        step_period: controller.step_period().into(),
        time: 0.0,
    };
    let mut guarantees = scenario.monitors();
    let mut flight = loaded.flight()?.with_disturbance(wind);
    flight.observe(scenario.ticks(), &mut guarantees);

    let away = flight.truth().position_world - DVec3::new(0.0, 0.0, 5.0);
    println!("offset in the steady wind: {away:.3} m");
    for verdict in guarantees.verdicts() {
        println!("{verdict}");
    }
    assert!(away.x > 0.0 && away.y < 0.0, "the vehicle is pushed downwind");
    assert!(guarantees.verdicts().iter().all(|verdict| verdict.pass), "every guarantee holds");
    Ok(())
}
