//! Faults at random times of a commanded flight, and the end that each comes to, judged on the truth.

use ctrl_core::allocation::BatteryConfig;
use ctrl_core::mode::navigation::{MissionItem, MissionKind, Request};
use ctrl_core::mode::safety::{
    AttitudeGuard, BatteryGuard, CrashGuard, Geofence, Hazards, Reaction, SafetyConfig,
    SaturationGuard, Silence,
};
use ctrl_core::mode::{Cause, Command, Mode};
use ctrl_core::setpoint::Setpoint;
use firmware::session::SessionMemory;
use glam::{DVec3, Vec3};
use mavlink_vehicle::Vehicle;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use sim::plant::Disturbance;
use sim::scenario::Scenario;

use super::error::FlyError;
use super::vehicle::{FlownVehicle, Interference};

/// Hazards that the flights are watched for.
pub const SAFETY: SafetyConfig = SafetyConfig {
    link: Some(Silence { timeout: 5.0, reaction: Reaction::Return }),
    rc: Some(Silence { timeout: 0.5, reaction: Reaction::Return }),
    battery: Some(BatteryGuard {
        low: 14.0,
        critical: 13.2,
        time: 1.0,
        low_reaction: Reaction::Return,
        critical_reaction: Reaction::Land,
    }),
    geofence: Some(Geofence { radius: 12.0, height: 20.0, reaction: Reaction::Return }),
    attitude: Some(AttitudeGuard {
        tilt: 1.2,
        rate: 10.0,
        time: 0.3,
        reaction: Reaction::Failsafe,
    }),
    saturation: Some(SaturationGuard { time: 3.0, reaction: Reaction::Land }),
    crash: Some(CrashGuard { tilt: 1.0, speed: 0.3, time: 1.0 }),
};

/// Supply of the flights' rotors.
const BATTERY: BatteryConfig = BatteryConfig { nominal_voltage: 15.5, smoothing_time: 0.2 };

/// Duration of a push (s).
const PUSH_TIME: f64 = 0.15;

/// Sign by which a fault must have been seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detection {
    /// The watch for hazards reported it.
    Hazard(Hazards),
    /// The supervisor changed its mode for this.
    Cause(Cause),
}

/// A fault of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlightFault {
    /// No state sample comes any more.
    EstimateLost,
    /// The station falls silent.
    LinkLost,
    /// The remote control falls silent.
    RcLost,
    /// The battery's voltage falls below the first level.
    BatteryLow,
    /// The battery's voltage falls below the second level.
    BatteryCritical,
    /// The vehicle is sent outside the fence.
    Geofence,
    /// A rotor gives nothing any more.
    DeadRotor,
    /// Every control period ends late.
    Overruns,
    /// The operator throws the kill switch.
    Kill,
    /// A push tips the vehicle over.
    TippedOver,
    /// A push sets it spinning about its axis.
    Spun,
    /// The rotors cannot carry the vehicle: their supply gives half of the thrust, and no guard watches the voltage.
    RotorsShort,
    /// A collision throws it to the ground, and no guard watches tilt and rate in the air.
    Crash,
}

impl FlightFault {
    /// Every fault.
    pub const ALL: [Self; 13] = [
        Self::EstimateLost,
        Self::LinkLost,
        Self::RcLost,
        Self::BatteryLow,
        Self::BatteryCritical,
        Self::Geofence,
        Self::DeadRotor,
        Self::Overruns,
        Self::Kill,
        Self::TippedOver,
        Self::Spun,
        Self::RotorsShort,
        Self::Crash,
    ];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::EstimateLost => "estimate lost",
            Self::LinkLost => "link lost",
            Self::RcLost => "remote control lost",
            Self::BatteryLow => "battery low",
            Self::BatteryCritical => "battery critical",
            Self::Geofence => "outside the geofence",
            Self::DeadRotor => "dead rotor",
            Self::Overruns => "control overruns",
            Self::Kill => "kill switch",
            Self::TippedOver => "tipped over",
            Self::Spun => "spun",
            Self::RotorsShort => "rotors short",
            Self::Crash => "crash",
        }
    }

    /// Detection that must have led to the end; none where several may, and it depends on the flight which.
    #[must_use]
    pub fn detection(self) -> Option<Detection> {
        Some(match self {
            Self::EstimateLost => Detection::Cause(Cause::SamplesMissed),
            Self::Overruns => Detection::Cause(Cause::Overruns),
            Self::Kill => Detection::Cause(Cause::Killed),
            Self::LinkLost => Detection::Hazard(Hazards::LINK_LOST),
            Self::RcLost => Detection::Hazard(Hazards::RC_LOST),
            Self::BatteryLow => Detection::Hazard(Hazards::BATTERY_LOW),
            Self::BatteryCritical => Detection::Hazard(Hazards::BATTERY_CRITICAL),
            Self::Geofence => Detection::Hazard(Hazards::GEOFENCE),
            Self::TippedOver | Self::Spun => Detection::Hazard(Hazards::ATTITUDE),
            Self::RotorsShort => Detection::Hazard(Hazards::SATURATION),
            Self::Crash => Detection::Hazard(Hazards::CRASH),
            // Tilt in the air; on the ground it does not lift.
            Self::DeadRotor => return None,
        })
    }

    /// Hazards that the flight is watched for: without those that would end it before the one that is to be seen.
    fn safety(self) -> SafetyConfig {
        match self {
            Self::RotorsShort => SafetyConfig { battery: None, ..SAFETY },
            Self::Crash => SafetyConfig { attitude: None, ..SAFETY },
            _ => SAFETY,
        }
    }

    /// `true` for a fault after which the vehicle still flies by its law.
    #[must_use]
    pub fn lands(self) -> bool {
        matches!(
            self,
            Self::LinkLost
                | Self::RcLost
                | Self::BatteryLow
                | Self::BatteryCritical
                | Self::Geofence
        )
    }

    /// `true` for a fault after which the vehicle comes home.
    #[must_use]
    pub fn comes_home(self) -> bool {
        self.lands() && self != Self::BatteryCritical
    }

    fn interference(self, time: f64, index: usize) -> Interference {
        let none =
            Interference { voltage: Some(BATTERY.nominal_voltage), ..Interference::default() };
        let pushed = |torque_body, up: f64| {
            let acceleration_world = DVec3::Z * up;
            let push = Disturbance { acceleration_world, torque_body, ..Disturbance::NONE };
            Interference { push: Some((push, time + PUSH_TIME)), ..none }
        };
        match self {
            Self::EstimateLost => Interference { sample_lost: true, ..none },
            Self::LinkLost => Interference { link_lost_since: Some(time), ..none },
            Self::RcLost => Interference { rc_lost_since: Some(time), ..none },
            Self::BatteryLow => Interference { voltage: Some(13.8), ..none },
            Self::BatteryCritical => Interference { voltage: Some(12.9), ..none },
            Self::DeadRotor => Interference { failed_rotor: Some(index % 4), ..none },
            Self::Overruns => Interference { overrun: true, ..none },
            Self::Kill => Interference { kill: true, ..none },
            Self::Geofence => none,
            // Turns by 6 rad/s; the law takes a second and more to stop that.
            Self::TippedOver => pushed(DVec3::new(2.0, 0.0, 0.0), 0.0),
            // Turns by 15 rad/s.
            Self::Spun => pushed(DVec3::new(0.0, 0.0, 10.0), 0.0),
            // Half of the thrust at the nominal voltage: 8.0 N for a weight of 8.3 N.
            Self::RotorsShort => {
                Interference { voltage: Some(BATTERY.nominal_voltage * 0.707), ..none }
            }
            Self::Crash => pushed(DVec3::new(1.0, -1.5, 0.0), -40.0),
        }
    }
}

/// End of a flight, from the truth of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultOutcome {
    /// Time of the fault since the start (s).
    pub fault_time: f64,
    /// Time from the fault until the vehicle stood with its rotors stopped (s); none if it never did.
    pub ended_after: Option<f64>,
    /// Speed at the touchdown (m/s).
    pub touchdown_speed: f64,
    /// Horizontal distance from the place of the start at the end (m).
    pub from_home: f64,
    /// Largest thrust while disarmed or locked (N).
    pub thrust_disarmed: f64,
    /// Hazards that were reported after the fault.
    pub hazards: Hazards,
    /// Cause of the latest change to a safer mode.
    pub cause: Option<Cause>,
    /// The supervisor's mode at the end.
    pub mode: Mode,
}

/// Longest time that a flight may take to its end after the fault (s).
pub const PATIENCE: f64 = 150.0;
/// Touchdown speed that a landing keeps (m/s).
pub const LANDING_SPEED: f64 = 0.8;
/// Distance from home at which a return ends (m).
pub const HOME_RADIUS: f64 = 1.0;

impl FaultOutcome {
    fn detected(&self, fault: FlightFault) -> bool {
        match fault.detection() {
            None => true,
            Some(Detection::Hazard(hazard)) => self.hazards.contains(hazard),
            Some(Detection::Cause(cause)) => self.cause == Some(cause),
        }
    }

    /// Reason why the end is not as it must be, if it is not.
    #[must_use]
    pub fn violation(&self, fault: FlightFault) -> Option<&'static str> {
        if self.ended_after.is_none() {
            Some("not on the ground with stopped rotors")
        } else if self.thrust_disarmed > 0.0 {
            Some("rotors turned while disarmed")
        } else if !self.detected(fault) {
            Some("ended without being detected as what it was")
        } else if fault.lands() && self.touchdown_speed > LANDING_SPEED {
            Some("touched down too fast")
        } else if fault.comes_home() && self.from_home > HOME_RADIUS {
            Some("did not come home")
        } else {
            None
        }
    }
}

/// Flies the vehicle of `scenario` on a random mission, lets `fault` happen at a random time of it, and waits for
/// the end.
///
/// # Errors
/// When the scenario cannot be flown under commands.
pub fn fly_with_fault(
    scenario: &Scenario,
    fault: FlightFault,
    seed: u64,
) -> Result<FaultOutcome, FlyError> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut random = |lower: f32, upper: f32| {
        let share = (generator.next_u64() >> 40) as f32 / (1u64 << 24) as f32;
        lower + (upper - lower) * share
    };
    let mut memory = SessionMemory::new();
    let scenario = Scenario { seed, ..scenario.clone() };
    let mut vehicle = FlownVehicle::new(&scenario, &mut memory)?;
    vehicle.set_safety(&fault.safety())?;
    vehicle.set_battery(&BATTERY)?;
    let home = vehicle.truth().position_world;
    let item =
        |number, position_world| MissionItem { position_world, number, ..MissionItem::default() };
    let mut items = vec![MissionItem {
        kind: MissionKind::TakeOff,
        ..item(0, Vec3::new(0.0, 0.0, random(1.0, 4.0)))
    }];
    for number in 1..60 {
        let around = Vec3::new(random(-5.0, 5.0), random(-5.0, 5.0), random(1.5, 5.0));
        items.push(item(number, around + home.as_vec3().with_z(0.0)));
    }
    // A vehicle that is thrown down from a hand's breadth stands on its feet again, and flies on.
    let earliest = if fault == FlightFault::Crash { 8.0 } else { 1.0 };
    let fault_time = f64::from(random(earliest, 40.0));
    let rotor = random(0.0, 4.0) as usize;
    let outside = home.as_vec3() + Vec3::new(random(14.0, 20.0), random(-5.0, 5.0), 3.0);

    let calm = Interference { voltage: Some(BATTERY.nominal_voltage), ..Interference::default() };
    vehicle.interfere(calm);
    run(&mut vehicle, 0.5);
    vehicle.piloted().navigator().set_mission(items.into_iter())?;
    // None waits: the vehicle is new.
    let _ = vehicle.piloted().command(Command::Arm);
    run(&mut vehicle, 0.2);
    let mode = vehicle.mode();
    // Refusals show in the end: a vehicle that never flew does not pass.
    let _ = vehicle.pilot().request(mode, Request::Mission);
    run(&mut vehicle, fault_time);
    let flew = vehicle.mode() == Mode::Flying;
    vehicle.interfere(fault.interference(vehicle.time(), rotor));
    if fault == FlightFault::Geofence {
        let _ = vehicle.pilot().request(Mode::Flying, Request::GoTo(Setpoint::at(outside)));
    }
    let (began, mut ended_after, mut thrust_disarmed) = (vehicle.time(), None, 0.0f64);
    let (mut hazards, mut cause) = (Hazards::empty(), None);
    while vehicle.time() < began + PATIENCE && ended_after.is_none() {
        let flown = vehicle.tick();
        if fault != FlightFault::LinkLost {
            vehicle.hear();
        }
        hazards |= flown.outputs.safety.hazards;
        cause = flown.outputs.cause;
        let stopped = matches!(flown.outputs.mode, Mode::Disarmed | Mode::Locked);
        if stopped {
            thrust_disarmed = thrust_disarmed.max(flown.outputs.achieved.thrust.abs().into());
        }
        if flew && stopped && flown.outputs.thrusts.is_none() && vehicle.plant().stands() {
            ended_after = Some(vehicle.time() - began);
        }
    }
    let from = vehicle.truth().position_world - home;
    Ok(FaultOutcome {
        fault_time,
        ended_after,
        touchdown_speed: vehicle.plant().touchdown_speed(),
        from_home: from.x.hypot(from.y),
        thrust_disarmed,
        hazards,
        cause,
        mode: vehicle.mode(),
    })
}

/// Flies with a station and a remote control that are there.
fn run(vehicle: &mut FlownVehicle<'_>, seconds: f64) {
    let end = vehicle.time() + seconds;
    while vehicle.time() < end {
        vehicle.tick();
        vehicle.hear();
    }
}
