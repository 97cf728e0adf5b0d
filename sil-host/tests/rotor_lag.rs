//! Rotors that lag: the largest lag that each law survives without a model of the rotors, with one, with a lead filter
//! in the allocation alone, and with both; and what each costs under a noisy rate. The tables of docs/theory.md are the
//! asserted ones.

use ctrl_core::controller::{
    AnyController, AnyControllerState, ControllerConfig, StepOutput, TrackingController,
};
use ctrl_core::reference::Reference;
use ctrl_core::rotors::RotorModel;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use sil_host::tune::proposal::Proposal;
use sil_host::tune::request::{Request, WantedOptions};
use sim::closed_loop::ObservedController;
use sim::observer::Observer;
use sim::scenario::{LoadedScenario, Scenario, flight_with};
use sim::tick::Tick;

/// A quadrotor of half a kilogram; with [`LIMITS`] under controller 2.
const VEHICLE: &str = "
name = \"quadrotor\"
mass = { lower = 0.45, upper = 0.55 }
inertia = { lower = [3e-3, 3e-3, 6e-3], upper = [4.5e-3, 4.5e-3, 9e-3] }
disturbance_acceleration = 0.2
disturbance_torque = [0.005, 0.005, 0.003]
reference_acceleration_max = 0.5
step_period = 0.002
";
const LIMITS: &str = "thrust_max = 16.0\ntorque_max = [0.6, 0.6, 0.15]\n";

/// Bandwidths of the position that gains are tuned for (rad/s).
const BANDWIDTHS: [f64; 3] = [1.5, 2.5, 3.5];

/// Lags of the sweep (ms).
const LAGS: [u32; 17] = [5, 10, 15, 20, 25, 30, 40, 50, 60, 70, 80, 90, 100, 150, 200, 300, 400];

const PAGE: &str = include_str!("../../docs/theory.md");

/// Quotient of the lag and what the lead leaves of it.
const LEAD: f32 = 4.0;

/// Means against the lag.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Means {
    None,
    /// The law takes the torque that the model says acts.
    Model,
    /// A lead filter behind the law, which knows nothing of it.
    Lead,
    /// Model and lead in one.
    Both,
}

const MEANS: [Means; 4] = [Means::None, Means::Model, Means::Lead, Means::Both];

/// A law with a lead filter behind it, as an allocation would have it.
struct Led {
    law: AnyController,
    limit: Vec3,
    /// `1 - e^(-dt/T_f)`, and its quotient with that of the lag.
    gained: f32,
    ratio: f32,
}

impl TrackingController for Led {
    type State = (AnyControllerState, Vec3);

    fn initial_state(&self) -> Self::State {
        (self.law.initial_state(), Vec3::ZERO)
    }

    fn step(
        &self,
        state: &mut Self::State,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        let (law, filtered) = state;
        let mut output = self.law.step(law, vehicle, reference);
        let demand = output.wrench.torque_body;
        let led = *filtered + self.ratio * (demand - *filtered);
        *filtered += self.gained * (demand - *filtered);
        output.wrench.torque_body = led.clamp(-self.limit, self.limit);
        output
    }

    fn step_period(&self) -> f32 {
        self.law.step_period()
    }
}

impl ObservedController for Led {}

/// Largest distance (m) and body rate (rad/s) over the second half of a flight.
#[derive(Default)]
struct Worst {
    half: f64,
    distance: f64,
    rate: f64,
}

impl Observer for Worst {
    fn observe(&mut self, tick: &Tick) {
        if tick.time >= self.half {
            let reference = tick.reference.position_world.as_dvec3();
            self.distance = self.distance.max(tick.truth.position_world.distance(reference));
            self.rate = self.rate.max(tick.truth.rate_body.length());
        }
    }
}

impl Worst {
    /// Hovers; NaN does not.
    fn hovers(&self) -> bool {
        self.distance < 0.5 && self.rate < 1.0
    }
}

fn with_model(law: &ControllerConfig, rotors: RotorModel) -> ControllerConfig {
    let mut law = *law;
    match &mut law {
        ControllerConfig::RobustAdaptive(config) => config.rotors = rotors,
        ControllerConfig::Saturated(config) => config.rotors = rotors,
    }
    law
}

/// Flies 20 s at hover behind rotors with the time constant `lag` (s) against `means` that take it for `known` (s).
fn observe(
    scenario: &Scenario,
    means: Means,
    [lag, known]: [f32; 2],
    observer: &mut impl Observer,
) {
    let mut scenario = scenario.clone();
    scenario.actuation.rotor_lag = Some(lag.into());
    let dt = scenario.controller.step_period();
    let residual_lag = (known / LEAD).max(dt.min(known));
    let rotors = match means {
        Means::None | Means::Lead => RotorModel::OFF,
        Means::Model => RotorModel { lag: known, residual_lag: known },
        Means::Both => RotorModel { lag: known, residual_lag },
    };
    let law = with_model(&scenario.controller, rotors).build().expect("accepted");
    let ticks = (20.0 / dt) as u64;
    if means == Means::Lead {
        let gained = |constant: f32| -libm::expm1f(-dt / constant);
        let gained = [gained(residual_lag), gained(known)];
        let limit = scenario.controller.torque_max().unwrap_or(Vec3::MAX);
        let led = Led { law, limit, gained: gained[0], ratio: gained[0] / gained[1] };
        flight_with(led, &scenario).expect("flies").observe(ticks, observer);
    } else {
        flight_with(law, &scenario).expect("flies").observe(ticks, observer);
    }
}

fn survives(scenario: &Scenario, means: Means, lag: f32, known: f32) -> bool {
    let mut worst = Worst { half: 10.0, ..Worst::default() };
    observe(scenario, means, [lag, known], &mut worst);
    worst.hovers()
}

/// Largest lag of the sweep up to which every flight hovers (ms); `known` of a lag is what the means take it for.
fn largest(scenario: &Scenario, means: Means, known: impl Fn(f32) -> f32) -> u32 {
    let flies = |&ms: &u32| {
        let lag = ms as f32 * 1e-3;
        survives(scenario, means, lag, known(lag))
    };
    LAGS.into_iter().take_while(flies).last().unwrap_or(0)
}

/// Gains of `tune` in a scenario with `change`.
fn tuned(limits: &str, bandwidth: f64, change: String) -> Scenario {
    let text = format!("{VEHICLE}{limits}[wanted]\nposition_bandwidth = {bandwidth}\n");
    let request = Request::parse("vehicle.toml", &text, WantedOptions::default()).expect("valid");
    let proposal = Proposal::new(request).unwrap_or_else(|error| panic!("{error}"));
    let loaded = LoadedScenario::parse("tuned", &proposal.scenario(), &[change]);
    loaded.unwrap_or_else(|error| panic!("{error}")).scenario().clone()
}

/// Fails unless each of `rows` is in the page.
fn assert_told(rows: &[String]) {
    rows.iter().for_each(|row| println!("{row}"));
    let missing: Vec<_> = rows.iter().filter(|row| !PAGE.contains(*row)).collect();
    assert!(missing.is_empty(), "docs/theory.md lacks {missing:#?}");
}

#[test]
fn the_largest_lag_is_that_of_the_table() {
    let mut rows = Vec::new();
    for (law, limits) in [(1, ""), (2, LIMITS)] {
        for bandwidth in BANDWIDTHS {
            for tilt in [10.0, 150.0] {
                let scenario = tuned(limits, bandwidth, format!("initial.tilt_deg={tilt}"));
                let [none, model, lead, both] =
                    MEANS.map(|means| largest(&scenario, means, |lag| lag));
                let [short, long] =
                    [0.5, 2.0].map(|factor| largest(&scenario, Means::Both, |lag| factor * lag));
                rows.push(format!(
                    "| {law} | {bandwidth} | {tilt} | {none} | {model} | {lead} | {both} | {short} | {long} |"
                ));
            }
        }
    }
    assert_told(&rows);
}

/// Sum of squares of the commanded torque (N m)^2 over the second half, in ticks.
#[derive(Default)]
struct Activity {
    half: f64,
    square: f64,
    ticks: f64,
}

impl Observer for Activity {
    fn observe(&mut self, tick: &Tick) {
        if tick.time >= self.half {
            self.square += tick.output.wrench.torque_body.as_dvec3().length_squared();
            self.ticks += 1.0;
        }
    }
}

#[test]
fn the_torque_under_a_noisy_rate_is_that_of_the_table() {
    let mut rows = Vec::new();
    for (law, limits) in [(1, ""), (2, LIMITS)] {
        let noise = "state_feedback.rate_body.white_noise=0.02".to_owned();
        let scenario = tuned(limits, 2.5, noise);
        let torques = MEANS.map(|means| {
            let mut activity = Activity { half: 10.0, ..Activity::default() };
            observe(&scenario, means, [0.03; 2], &mut activity);
            format!("{:.1}", 1e3 * (activity.square / activity.ticks).sqrt())
        });
        rows.push(format!("| {law} | {} |", torques.join(" | ")));
    }
    assert_told(&rows);
}
