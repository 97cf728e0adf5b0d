//! Rotors that saturate before the law does: controller 2 with and without being told what they make of its torque.

use ctrl_core::allocation::{Allocator, RotorGeometry};
use ctrl_core::controller::{AdaptiveController, TrackingController};
use ctrl_core::vehicle::{Interval, Wrench};
use glam::Vec3;
use sim::guarantee::tracking::{heading_error, tilt_error};
use sim::guarantee::{Guarantees, Requirement, Verdict};
use sim::observer::Observer;
use sim::plant::vehicle::{Plant, Vehicle};
use sim::plant::{AppliedWrench, Disturbance, PlantState};
use sim::scenario::{LoadedScenario, flight_with};
use sim::tick::Tick;

/// Rotors of 3.1 N each, 1.5 times what hover takes; their reaction torque is weak.
const WEAK: f32 = 0.004;
/// The same with a reaction torque that is weaker still, as a scenario has them.
const WEAKER: &str = "frame={ ring={ spins=[\"clockwise\", \"anticlockwise\", \"clockwise\", \"anticlockwise\"], \
                      arm=0.2, first_angle_deg=45, torque_ratio=0.0015, thrust={ lower=0.1, upper=3.1 } } }";

fn rotors(torque_ratio: f32) -> Allocator {
    let geometry = RotorGeometry::quad_x(0.2, torque_ratio, Interval { lower: 0.1, upper: 3.1 });
    Allocator::new(&geometry).expect("four rotors")
}

/// A vehicle whose rotors make of a command what their limits leave.
struct Rotored {
    vehicle: Vehicle,
    rotors: Allocator,
    told: bool,
}

impl Plant for Rotored {
    fn truth(&self) -> &PlantState {
        self.vehicle.truth()
    }

    fn tells_law(&self) -> bool {
        self.told
    }

    fn made(&self, command: &Wrench) -> Vec3 {
        self.rotors.allocate(command).achieved.torque_body
    }

    fn command(&mut self, wrench: &Wrench) -> AppliedWrench {
        self.vehicle.command(&self.rotors.allocate(wrench).achieved)
    }

    fn advance(&mut self, disturbance: &Disturbance) {
        self.vehicle.advance(disturbance);
    }
}

/// What is seen of a flight.
struct Seen {
    monitors: Guarantees,
    limited: u32,
    settled: f64,
    theta: f64,
}

impl Seen {
    fn new(monitors: Guarantees) -> Self {
        Self { monitors, limited: 0, settled: 0.0, theta: 0.0 }
    }
}

impl Observer for Seen {
    fn observe(&mut self, tick: &Tick) {
        self.monitors.observe(tick);
        let loss = tick.applied.torque_body - tick.output.wrench.torque_body.as_dvec3();
        self.limited += u32::from(loss.length() > 1e-6);
        let heading = heading_error(tick.truth.attitude, &tick.reference);
        let tilt = tilt_error(tick.truth.attitude, &tick.reference);
        let outside = heading > 0.1 || tilt > 0.1 || tick.position_error().length() > 0.5;
        if outside {
            self.settled = tick.time;
        }
        self.theta = tick.estimates.inverse_inertia.z.into();
    }
}

/// Flies the paper's limited vehicle from an attitude far off behind weak rotors.
fn fly(told: bool, changes: &[&str]) -> (Seen, Vec<Verdict>) {
    let changes: Vec<_> = changes.iter().map(ToString::to_string).collect();
    let loaded = LoadedScenario::open("paper-saturated", &changes);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let scenario = loaded.scenario();
    let law = scenario.controller.build().expect("valid");
    let start = scenario.vehicle(scenario.initial.state(), law.step_period().into());
    let vehicle = start.expect("no rotors of the scenario");
    let plant = Rotored { vehicle, rotors: rotors(WEAK), told };
    let flight = flight_with(law, scenario).expect("flies");
    let mut flight = flight.with_evaluator(scenario.evaluator()).with_plant(plant);
    let monitors = scenario.monitors();
    let mut seen = Seen::new(monitors);
    flight.observe(scenario.ticks(), &mut seen);
    let verdicts = seen.monitors.verdicts();
    (seen, verdicts)
}

#[test]
fn v_obeys_its_balance_where_the_law_is_told_what_the_rotors_make() {
    for tilt in [20.0, 100.0] {
        let tilt = format!("initial.tilt_deg={tilt}");
        let changes = [
            "duration=30",
            &tilt,
            "initial.heading_deg=20",
            "disturbance.noise.torque=0.01",
            "controller.saturated.uncertainty.disturbance_torque=0.01",
        ];
        for told in [false, true] {
            let (seen, verdicts) = fly(told, &changes);
            let name = "Lyapunov balance residual";
            let balance = verdicts.iter().find(|it| it.name.starts_with(name)).expect("a row");
            println!("{tilt} told {told}: {} ticks limited, {balance:?}", seen.limited);
            assert_eq!(balance.requirement, Requirement::AtMost(0.0));
            assert!(seen.limited > 100, "the rotors' limits act");
            assert_eq!(balance.pass, told, "{balance:?}");
        }
    }
}

/// A quarter turn that the yaw torque takes seconds for: the adaptation is not led astray, and the rotors' limits act half as long; the
/// turn takes about as long.
#[test]
fn estimates_stay_right_where_the_law_is_told_what_the_rotors_make() {
    let changes = [
        "duration=40",
        "vehicle.inertia=[0.06, 0.06, 0.06]",
        "initial.position=[100.0, 0.0, 0.0]",
        "initial.velocity=[0.0, 5.0, 1.0]",
        "initial.heading_deg=90",
        "disturbance.noise.torque=0.005",
        "controller.saturated.uncertainty.disturbance_torque=0.005",
        "controller.saturated.gamma2=200",
    ];
    let [left, told] = ["", "tells_law=true, "].map(|told| {
        let rotors = format!("rotors={{ {told}{WEAKER} }}");
        let changes: Vec<_> = changes.iter().map(ToString::to_string).chain([rotors]).collect();
        let loaded = LoadedScenario::open("paper-saturated", &changes);
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        let scenario = loaded.scenario();
        let mut flight = loaded.flight().expect("flies");
        let mut seen = Seen::new(scenario.monitors());
        flight.observe(scenario.ticks(), &mut seen);
        // Unobserved it is the same flight.
        let mut unobserved = loaded.flight().expect("flies");
        unobserved.advance(scenario.ticks());
        assert_eq!(unobserved.truth(), flight.truth());
        seen
    });
    for seen in [&left, &told] {
        println!("{} ticks limited, settled {} s, {}", seen.limited, seen.settled, seen.theta);
    }
    let error = |seen: &Seen| (0.06 * seen.theta - 1.0).abs();
    assert!(error(&told) < 0.05 && error(&left) > 0.2);
    assert!(f64::from(told.limited) < 0.7 * f64::from(left.limited));
    assert!((told.settled / left.settled - 1.0).abs() < 0.1);
}

/// Rotors that make every command leave the law its bits; what is not finite counts as the command.
#[test]
fn a_law_whose_commands_are_all_made_is_the_law() {
    let loaded = LoadedScenario::open("paper-saturated", &["initial.tilt_deg=60".to_owned()]);
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let law = loaded.scenario().controller.build().expect("valid");
    let mut states = [law.initial_state(); 3];
    let mut each_tick = EachTick(|tick: &Tick| {
        let (vehicle, reference) = (tick.truth.measured(), tick.reference);
        let [plain, made, unknown] = &mut states;
        let step = law.step(plain, &vehicle, &reference);
        let all = |wrench: &Wrench| wrench.torque_body;
        assert_eq!(law.step_limited(made, &vehicle, &reference, all, |_| {}), step);
        let none = |_: &Wrench| Vec3::NAN;
        assert_eq!(law.step_limited(unknown, &vehicle, &reference, none, |_| {}), step);
        assert_eq!((&*plain, &*plain), (&*made, &*unknown));
    });
    loaded.flight().expect("flies").observe(5_000, &mut each_tick);
}

struct EachTick<F>(F);

impl<F: FnMut(&Tick)> Observer for EachTick<F> {
    fn observe(&mut self, tick: &Tick) {
        (self.0)(tick);
    }
}
