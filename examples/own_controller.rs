//! A controller of one's own: the geometric controller on SE(3) of Lee, Leok and McClamroch (2010), written
//! from its published equations, against controller 1 on the same flight with the same table.
//!
//! `cargo run --release -p examples --bin own_controller`

use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::{Mat3, Vec3};
use sim::closed_loop::ObservedController;
use sim::guarantee::{Guarantees, Verdict};
use sim::number::number;
use sim::scenario::{LoadedScenario, flight_with};

/// Gains `k_x` (N/m), `k_v` (N s/m), `k_R` (N m), `k_W` (N m s).
const K_X: f32 = 6.0;
const K_V: f32 = 4.0;
const K_R: f32 = 4.0;
const K_W: f32 = 0.7;

/// The law, with the mass and inertia that it takes for the true ones.
struct Lee {
    mass: f32,
    inertia: Vec3,
    step_period: f32,
}

impl TrackingController for Lee {
    /// The commanded attitude of the step before, for the commanded rate by differences.
    type State = Option<Mat3>;

    fn initial_state(&self) -> Self::State {
        None
    }

    fn step(
        &self,
        before: &mut Self::State,
        state: &VehicleState,
        wanted: &Reference,
    ) -> StepOutput {
        let attitude = Mat3::from_quat(state.attitude);
        let e_x = state.position_world - wanted.position_world;
        let e_v = state.velocity_world - wanted.velocity_world;
        // The force command: -k_x e_x - k_v e_v + m g e3 + m x_d''.
        let feed_forward = self.mass * wanted.specific_force().value;
        let force = -K_X * e_x - K_V * e_v + feed_forward;
        // R_c = [b1c, b2c, b3c]: b3c along the force, body x as near to the desired one as that allows.
        let b3 = force.normalize_or(Vec3::Z);
        let b2 = b3.cross(wanted.left_world.cross(feed_forward)).normalize_or(wanted.left_world);
        let command = Mat3::from_cols(b2.cross(b3), b2, b3);
        let rate = vee(before.unwrap_or(command).transpose() * command) / self.step_period;
        *before = Some(command);
        // e_R = 1/2 (R_c^T R - R^T R_c)^v, e_W = W - R^T R_c W_c; W_c' is left out.
        let (relative, w) = (command.transpose() * attitude, state.rate_body);
        let carried = relative.transpose() * rate;
        let gyroscopic = w.cross(self.inertia * w) - self.inertia * w.cross(carried);
        let torque_body = -K_R * vee(relative) - K_W * (w - carried) + gyroscopic;
        let thrust = force.dot(attitude.z_axis).max(0.0);
        StepOutput::from(Wrench { thrust, torque_body })
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

/// No quantities of a law of the paper: ticks carry none, and the theorems' monitors do not apply.
impl ObservedController for Lee {}

/// `1/2 (M - M^T)^v`: the vector of the skew part.
fn vee(m: Mat3) -> Vec3 {
    0.5 * Vec3::new(m.y_axis.z - m.z_axis.y, m.z_axis.x - m.x_axis.z, m.x_axis.y - m.y_axis.x)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = LoadedScenario::open("lemniscate", &[])?;
    let scenario = loaded.scenario();
    let known = scenario.controller.initial(); // both laws begin with the same estimates
    let step_period = scenario.controller.step_period();
    let lee = Lee { mass: known.mass, inertia: known.inertia, step_period };
    let monitors = || Guarantees::of_any_controller(&scenario.guarantees, &scenario.actuation);
    let (mut ours, mut lees) = (monitors(), monitors());
    loaded.flight()?.observe(scenario.ticks(), &mut ours);
    flight_with(lee, scenario)?.observe(scenario.ticks(), &mut lees);
    let (ours, lees) = (ours.verdicts(), lees.verdicts());
    println!("{:<40} {:>12} {:>12}", "guarantee", "controller 1", "Lee");
    let cell = |row: &Verdict| row.observed.map_or_else(|| "-".to_owned(), number);
    for (ours, lees) in ours.iter().zip(&lees) {
        println!("{:<40} {:>12} {:>12}", ours.name, cell(ours), cell(lees));
    }
    assert!(ours.iter().all(|verdict| verdict.pass), "controller 1 holds its bounds");
    let position = |row: &&Verdict| row.equation == "(5)";
    let error = |table: &[Verdict]| table.iter().find(position).and_then(|it| it.observed);
    let (lee, ours) = (error(&lees).expect("flown"), error(&ours).expect("flown"));
    assert!(lee < 0.3 && ours < 0.1 * lee, "the estimate removes the offset");
    Ok(())
}
