//! A trajectory of one's own: a smooth climb and descent while the nose turns, under controller 2 and every
//! monitor of its theorem.
//!
//! `cargo run --release -p examples --bin own_trajectory`

use ctrl_core::controller::AdaptiveController;
use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::Trajectory;
use glam::Vec3;
use sim::scenario::LoadedScenario;

/// `z = height - amplitude cos(w t)` above the origin, body x towards the angle `yaw_rate t`.
struct Bob {
    height: f32,
    amplitude: f32,
    angular_rate: f32,
    yaw_rate: f32,
    step_period: f32,
}

impl Trajectory for Bob {
    /// Derivatives up to the fourth, and the heading with two: the laws differentiate the force command.
    fn reference(&self, tick: u64) -> Reference {
        let time = tick as f64 * f64::from(self.step_period);
        let (w, a) = (self.angular_rate, self.amplitude);
        let (sin, cos) = libm::sincosf((f64::from(w) * time) as f32);
        let rising = Reference {
            velocity_world: a * w * sin * Vec3::Z,
            acceleration_world: a * w * w * cos * Vec3::Z,
            jerk_world: -a * w * w * w * sin * Vec3::Z,
            snap_world: -a * w * w * w * w * cos * Vec3::Z,
            ..Reference::hover((self.height - a * cos) * Vec3::Z)
        };
        let yaw_rate = self.yaw_rate;
        let (sin, cos) = libm::sincosf((f64::from(yaw_rate) * time) as f32);
        let (forward, left) = (Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0));
        rising.facing(Jet::new(forward, yaw_rate * left, -yaw_rate * yaw_rate * forward))
    }

    fn acceleration_bound(&self) -> f32 {
        self.amplitude * self.angular_rate * self.angular_rate
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let changes = ["initial.position=[1.0, 0.0, 2.0]", "initial.heading_deg=0.0", "duration=120"];
    let settling = "guarantees.settle_time=90.0".to_owned();
    let changes: Vec<_> = changes.iter().map(ToString::to_string).chain([settling]).collect();
    let loaded = LoadedScenario::open("paper-saturated", &changes)?;
    let scenario = loaded.scenario();
    let step_period = scenario.controller.step_period();
    let bob = |angular_rate| Bob {
        height: 3.0,
        amplitude: 1.0,
        angular_rate,
        yaw_rate: 0.2,
        step_period,
    };
    let flight = loaded.flight()?;
    flight.controller().accept(&bob(0.4))?; // Assumption 4: the acceleration is within M_p
    let mut guarantees = scenario.monitors();
    let mut flight = flight.with_trajectory(bob(0.4));
    flight.observe(scenario.ticks(), &mut guarantees);
    for verdict in guarantees.verdicts() {
        println!("{verdict}");
    }
    assert!(guarantees.verdicts().iter().all(|verdict| verdict.pass), "every guarantee holds");

    // A faster one exceeds the acceleration that the controller is built for, and is refused.
    let refusal =
        loaded.flight()?.controller().accept(&bob(0.6)).expect_err("0.36 m/s^2 exceeds M_p");
    println!("refused: {refusal}");
    Ok(())
}
