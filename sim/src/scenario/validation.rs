//! Checks beyond the types of fields: ranges of the fields of the simulation, and the theorems' assumptions.

use ctrl_core::controller::ControllerConfig;
use ctrl_core::vehicle::Interval;
use glam::{DVec3, Vec3};

use super::Scenario;
use crate::feedback::StateFeedbackConfig;
use crate::guarantee::bounds::ThrustBounds;
use crate::guarantee::state_error;
use crate::norm::Norm;
use crate::number::number;
use crate::plant::actuation::ActuationConfig;
use crate::plant::rotors::{BatteryModel, RotorFailure, RotorsConfig};
use crate::sensor::SensorsConfig;

/// A range that one value must keep.
struct Check {
    path: &'static str,
    value: f64,
    holds: fn(f64) -> bool,
    bound: &'static str,
}

/// Path and message of the first value outside its range. The controller and the trajectory check
/// their own.
pub(super) fn first_fault(scenario: &Scenario) -> Option<(&'static str, String)> {
    checks(scenario)
        .into_iter()
        .find(|check| !(check.value.is_finite() && (check.holds)(check.value)))
        .map(|check| (check.path, format!("{} must be {}", check.value, check.bound)))
        .or_else(|| faulty_state_feedback(scenario))
        .or_else(|| faulty_rotors(scenario))
        .or_else(|| idle_integral_gain(scenario))
        .or_else(|| first_infinite_vector(scenario).map(|path| (path, "must be finite".to_owned())))
        .or_else(|| super::check_name(&scenario.name).err().map(|message| ("name", message)))
        .or_else(|| impossible_inertia(scenario).map(|message| ("vehicle.inertia", message)))
}

/// `[state_feedback]` out of its range, or beside sensors.
fn faulty_state_feedback(scenario: &Scenario) -> Option<(&'static str, String)> {
    let feedback = &scenario.state_feedback;
    let step_period = f64::from(scenario.controller.step_period());
    let fault = feedback.first_fault(step_period);
    let fault = fault.map(|(path, value, bound)| (path, format!("{value} must be {bound}")));
    let beside_sensors = scenario.sensors.is_some() && *feedback != StateFeedbackConfig::default();
    fault.or_else(|| {
        beside_sensors.then(|| {
            let message = "must be absent beside [sensors], whose estimate the controller receives: \
                           noise and delay are those of the sensors";
            ("state_feedback", message.to_owned())
        })
    })
}

/// Relative excess of a moment of inertia over the sum of the other two that is accepted: measured values
/// are rounded, and those of the paper's own vehicle exceed it by 0.92 %.
const INERTIA_TOLERANCE: f64 = 0.01;

/// Principal moments of inertia that no rigid body has: one exceeds the sum of the other two.
fn impossible_inertia(scenario: &Scenario) -> Option<String> {
    let inertia = scenario.vehicle.inertia;
    let (sum, largest) = (inertia.element_sum(), inertia.max_element());
    (largest > (1.0 + INERTIA_TOLERANCE) * (sum - largest)).then(|| {
        let [x, y, z] = inertia.to_array();
        format!(
            "no rigid body has [{x}, {y}, {z}] kg m^2: each moment must be at most the sum of the other two, within 1 %"
        )
    })
}

fn checks(scenario: &Scenario) -> Vec<Check> {
    let at = |path, value, holds, bound| Check { path, value, holds, bound };
    let positive = |path, value| at(path, value, |x| x > 0.0, "positive");
    let not_negative = |path, value| at(path, value, |x| x >= 0.0, "zero or positive");
    let finite = |path, value| at(path, value, |_| true, "finite");
    let Scenario { vehicle, initial, disturbance, guarantees, .. } = scenario;
    let steps = f64::from(scenario.plant_steps_per_tick);
    let mut checks = vec![
        at("duration", scenario.duration, |x| x > 0.0 && x <= 1e6, "in (0, 1e6] s"),
        at("plant_steps_per_tick", steps, |x| (1.0..=1000.0).contains(&x), "in [1, 1000]"),
        positive("vehicle.mass", vehicle.mass),
        positive("vehicle.inertia", vehicle.inertia.min_element()),
        finite("initial.heading_deg", initial.heading_deg),
        at("initial.tilt_deg", initial.tilt_deg, |x| (0.0..=180.0).contains(&x), "in [0, 180] deg"),
        finite("initial.tilt_direction_deg", initial.tilt_direction_deg),
        not_negative("guarantees.settle_time", guarantees.settle_time),
        positive("guarantees.position_error_max", guarantees.position_error_max),
        positive("guarantees.attitude_error_max", guarantees.attitude_error_max),
        positive("guarantees.tilt_error_max", guarantees.tilt_error_max),
        positive("guarantees.heading_error_max", guarantees.heading_error_max),
        positive("guarantees.lyapunov_window", guarantees.lyapunov_window),
    ];
    if let Some(errors) = guarantees.state_error {
        checks.push(positive("guarantees.state_error.position", errors.position));
        checks.push(positive("guarantees.state_error.velocity", errors.velocity));
        checks.push(positive("guarantees.state_error.force", errors.force));
        if let Some(errors) = errors.attitude_loop {
            const TABLE: [&str; 3] = [
                "guarantees.state_error.attitude_loop.attitude",
                "guarantees.state_error.attitude_loop.rate",
                "guarantees.state_error.attitude_loop.mass",
            ];
            let given = [errors.attitude, errors.rate, errors.mass];
            checks.extend(TABLE.into_iter().zip(given).map(|(name, value)| positive(name, value)));
        }
        let (time, law) = (guarantees.settle_time, &scenario.controller);
        let bound = state_error::position_bound(&errors, time, law).unwrap_or(f64::NEG_INFINITY);
        const SMALL: &str = "finite: what the errors add must stay below M1 and M2";
        checks.push(at("guarantees.state_error", bound, |_| true, SMALL));
    }
    checks.extend(actuation_checks(&scenario.actuation));
    checks.extend(scenario.rotors.iter().flat_map(rotor_checks));
    checks.extend(scenario.sensors.iter().flat_map(sensor_checks));
    if let Some(noise) = disturbance.noise {
        checks.push(not_negative("disturbance.noise.acceleration", noise.acceleration));
        checks.push(not_negative("disturbance.noise.torque", noise.torque.min_element()));
    }
    if let Some(gust) = disturbance.gust {
        checks.push(positive("disturbance.gust.hold", gust.hold));
        checks.push(not_negative("disturbance.gust.acceleration", gust.acceleration));
        checks.push(not_negative("disturbance.gust.torque", gust.torque.min_element()));
    }
    if let Some(wind) = disturbance.dryden {
        checks.push(positive("disturbance.dryden.wind_speed", wind.wind_speed));
        checks.push(finite("disturbance.dryden.direction_deg", wind.direction_deg));
        let low = |x| (3.0..=300.0).contains(&x);
        checks.push(at("disturbance.dryden.height", wind.height, low, "in [3, 300] m"));
        checks.push(not_negative("disturbance.dryden.drag", wind.drag));
    }
    if let Some(sinusoid) = disturbance.sinusoid {
        checks.push(positive("disturbance.sinusoid.frequency", sinusoid.frequency));
    }
    checks
}

fn actuation_checks(actuation: &ActuationConfig) -> impl Iterator<Item = Check> {
    let positive: fn(f64) -> bool = |x| x > 0.0;
    let delay: fn(f64) -> bool = |x| (0.0..=ActuationConfig::DELAY_MAX).contains(&x);
    let lag: fn(f64) -> bool = |x| (0.0..=ActuationConfig::ROTOR_LAG_MAX).contains(&x);
    [
        ("actuation.thrust_max", actuation.thrust_max, positive, "positive"),
        (
            "actuation.torque_max",
            actuation.torque_max.map(DVec3::min_element),
            positive,
            "positive",
        ),
        ("actuation.delay", actuation.delay, delay, "in [0, 1] s"),
        ("actuation.rotor_lag", actuation.rotor_lag, lag, "in [0, 10] s"),
    ]
    .into_iter()
    .filter_map(|(path, value, holds, bound)| Some(Check { path, value: value?, holds, bound }))
}

/// Ranges of `[rotors]`; the allocation checks the frame itself.
fn rotor_checks(rotors: &RotorsConfig) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut require = |path, value, holds: fn(f64) -> bool, bound| {
        checks.push(Check { path, value, holds, bound });
    };
    if let Some(curve) = rotors.thrust_curve {
        require("rotors.thrust_curve.quadratic", curve.quadratic, share, SHARE);
        require("rotors.thrust_curve.assumed", curve.assumed.unwrap_or(1.0), share, SHARE);
    }
    let drag: fn(f64) -> bool = |x| (0.0..=10.0).contains(&x);
    require("rotors.drag", rotors.drag.unwrap_or(0.0), drag, "in [0, 10] N s/m per root newton");
    if let Some(it) = rotors.battery {
        let volts: fn(f64) -> bool = |x| (1.0..=1000.0).contains(&x);
        const VOLTS: &str = "in [1, 1000] V";
        require("rotors.battery.full_voltage", it.full_voltage, volts, VOLTS);
        require("rotors.battery.nominal_voltage", it.nominal_voltage, volts, VOLTS);
        require("rotors.battery.empty_voltage", it.empty_voltage, volts, VOLTS);
        let ohms: fn(f64) -> bool = |x| (1e-6..=100.0).contains(&x);
        require("rotors.battery.resistance", it.resistance, ohms, "in [1e-6, 100] ohm");
        require("rotors.battery.capacity", it.capacity, positive, "positive");
        require("rotors.battery.charge", it.charge.unwrap_or(1.0), share, SHARE);
        require("rotors.battery.power_factor", it.power_factor, not_negative, "zero or positive");
        let times: fn(f64) -> bool = |x| x > 0.0 && x <= 100.0;
        let time = it.compensation_time.unwrap_or(1.0);
        require("rotors.battery.compensation_time", time, times, "in (0, 100] s");
    }
    checks
}

/// A gain of the integral action whose estimate has no bound, so that it would do nothing.
fn idle_integral_gain(scenario: &Scenario) -> Option<(&'static str, String)> {
    let paths = match scenario.controller {
        ControllerConfig::RobustAdaptive(_) => [
            "controller.robust_adaptive.integral.gamma_d",
            "controller.robust_adaptive.integral.gamma_t",
        ],
        ControllerConfig::Saturated(_) => {
            ["controller.saturated.integral.gamma_d", "controller.saturated.integral.gamma_t"]
        }
    };
    let it = scenario.controller.integral();
    let pairs = [
        (it.gamma_d, it.acceleration_max, "acceleration_max"),
        (it.gamma_t, it.torque_max, "torque_max"),
    ];
    let idle =
        paths.into_iter().zip(pairs).find(|(_, (gain, bound, _))| *gain > 0.0 && *bound == 0.0);
    idle.map(|(path, (gain, _, name))| (path, format!("{gain} must be 0 while {name} is 0")))
}

/// A failure of a rotor that is not there, or out of its range; a battery that is fuller at less voltage; limits of the wrench beside those of rotors.
fn faulty_rotors(scenario: &Scenario) -> Option<(&'static str, String)> {
    let rotors = scenario.rotors.as_ref()?;
    let count = rotors.frame.geometry().rotors.len();
    for (index, failure) in rotors.failures.iter().enumerate() {
        let RotorFailure { rotor, time, thrust_left, reallocated_after } = *failure;
        let fault = if rotor >= count {
            Some(format!("rotor {rotor} must be below {count}, the number of rotors"))
        } else if !(time.is_finite() && time >= 0.0) {
            Some(format!("time {time} must be zero or positive"))
        } else if !share(thrust_left) {
            Some(format!("thrust_left {thrust_left} must be {SHARE}"))
        } else {
            let bad = reallocated_after.filter(|after| !(after.is_finite() && *after >= 0.0));
            bad.map(|after| format!("reallocated_after {after} must be zero or positive"))
        };
        if let Some(fault) = fault {
            return Some(("rotors.failures", format!("failure {index}: {fault}")));
        }
    }
    let battery = rotors.battery.filter(|it| it.full_voltage < it.empty_voltage);
    if let Some(BatteryModel { full_voltage, empty_voltage, .. }) = battery {
        let message = format!("{full_voltage} must be at least the empty voltage, {empty_voltage}");
        return Some(("rotors.battery.full_voltage", message));
    }
    let limits = [
        ("actuation.thrust_max", scenario.actuation.thrust_max.is_some()),
        ("actuation.torque_max", scenario.actuation.torque_max.is_some()),
    ];
    let message = "must be absent beside [rotors], whose own limits act";
    limits.into_iter().find(|(_, set)| *set).map(|(path, _)| (path, message.to_owned()))
}

fn positive(x: f64) -> bool {
    x > 0.0
}

fn not_negative(x: f64) -> bool {
    x >= 0.0
}

fn share(x: f64) -> bool {
    (0.0..=1.0).contains(&x)
}

fn delay(x: f64) -> bool {
    (0.0..=0.5).contains(&x)
}

const SHARE: &str = "in [0, 1]";
const DELAY: &str = "in [0, 0.5] s";

/// Rangefinder and optical flow.
fn ground_checks(sensors: &SensorsConfig) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut require = |path, value, holds: fn(f64) -> bool, bound| {
        checks.push(Check { path, value, holds, bound });
    };
    if let Some(it) = sensors.rangefinder() {
        require("sensors.rangefinder.custom.rate", it.rate, positive, "positive");
        require("sensors.rangefinder.custom.delay", it.delay, delay, DELAY);
        require("sensors.rangefinder.custom.noise", it.noise, positive, "positive");
        require("sensors.rangefinder.custom.nearest", it.nearest, not_negative, "zero or positive");
        let beyond = it.farthest - it.nearest;
        require("sensors.rangefinder.custom.farthest", beyond, positive, "beyond the nearest");
        require("sensors.rangefinder.custom.dropout", it.dropout, share, SHARE);
    }
    if let Some(it) = sensors.flow() {
        require("sensors.flow.custom.rate", it.rate, positive, "positive");
        require("sensors.flow.custom.delay", it.delay, delay, DELAY);
        require("sensors.flow.custom.noise", it.noise, positive, "positive");
        require("sensors.flow.custom.range", it.range, positive, "positive");
        let beyond = it.farthest - it.nearest;
        require("sensors.flow.custom.farthest", beyond, positive, "beyond the nearest");
        require("sensors.flow.custom.dropout", it.dropout, share, SHARE);
    }
    checks
}

fn vibration_checks(sensors: &SensorsConfig) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut require = |path, value, holds: fn(f64) -> bool, bound| {
        checks.push(Check { path, value, holds, bound });
    };
    if let Some(it) = &sensors.vibration {
        let rotors: fn(f64) -> bool = |x| (1.0..=8.0).contains(&x);
        require("sensors.vibration.rotors", it.rotors.into(), rotors, "in [1, 8]");
        require("sensors.vibration.frequency", it.frequency, positive, "positive");
        require("sensors.vibration.spread", it.spread, share, SHARE);
        let acceleration = it.acceleration;
        require("sensors.vibration.acceleration", acceleration, not_negative, "zero or positive");
        require("sensors.vibration.rate", it.rate, not_negative, "zero or positive");
    }
    for fault in &sensors.faults {
        require("sensors.faults", fault.start, not_negative, "at a start that is zero or positive");
        require(
            "sensors.faults",
            fault.duration,
            not_negative,
            "of a duration that is not negative",
        );
    }
    checks
}

fn sensor_checks(sensors: &SensorsConfig) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut require = |path, value, holds: fn(f64) -> bool, bound| {
        checks.push(Check { path, value, holds, bound });
    };
    let it = sensors.imu();
    for (path, value) in [
        ("sensors.imu.custom.rate", it.rate),
        ("sensors.imu.custom.gyro_noise_density", it.gyro_noise_density),
        ("sensors.imu.custom.gyro_range", it.gyro_range),
        ("sensors.imu.custom.gyro_sensitivity", it.gyro_sensitivity),
        ("sensors.imu.custom.accelerometer_noise_density", it.accelerometer_noise_density),
        ("sensors.imu.custom.accelerometer_range", it.accelerometer_range),
        ("sensors.imu.custom.accelerometer_sensitivity", it.accelerometer_sensitivity),
    ] {
        require(path, value, positive, "positive");
    }
    for (path, value) in [
        ("sensors.imu.custom.filter_cutoff", it.filter_cutoff),
        ("sensors.imu.custom.gyro_bias_walk", it.gyro_bias_walk),
        ("sensors.imu.custom.gyro_offset", it.gyro_offset),
        ("sensors.imu.custom.accelerometer_bias_walk", it.accelerometer_bias_walk),
        ("sensors.imu.custom.accelerometer_offset", it.accelerometer_offset),
        ("sensors.imu.custom.scale_error", it.scale_error),
        ("sensors.imu.custom.misalignment", it.misalignment),
    ] {
        require(path, value, not_negative, "zero or positive");
    }
    let rate: fn(f64) -> bool = |x| x <= 8000.0;
    require("sensors.imu.custom.rate", it.rate, rate, "at most 8000 Hz");
    checks.extend(measurement_checks(sensors));
    checks.extend(ground_checks(sensors));
    checks.extend(vibration_checks(sensors));
    checks
}

/// Barometer, magnetometer, GNSS, motion capture.
fn measurement_checks(sensors: &SensorsConfig) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut require = |path, value, holds: fn(f64) -> bool, bound| {
        checks.push(Check { path, value, holds, bound });
    };
    if let Some(it) = sensors.barometer() {
        require("sensors.barometer.custom.rate", it.rate, positive, "positive");
        require("sensors.barometer.custom.delay", it.delay, delay, DELAY);
        require("sensors.barometer.custom.noise", it.noise, positive, "positive");
        let resolution = it.resolution;
        require(
            "sensors.barometer.custom.resolution",
            resolution,
            not_negative,
            "zero or positive",
        );
        require("sensors.barometer.custom.dropout", it.dropout, share, SHARE);
        require("sensors.barometer.custom.offset", it.offset, not_negative, "zero or positive");
        require("sensors.barometer.custom.walk", it.walk, not_negative, "zero or positive");
    }
    if let Some(it) = sensors.magnetometer() {
        require("sensors.magnetometer.custom.rate", it.rate, positive, "positive");
        require("sensors.magnetometer.custom.delay", it.delay, delay, DELAY);
        require("sensors.magnetometer.custom.noise", it.noise, positive, "positive");
        let horizontal = it.field_world.with_z(0.0).norm();
        require("sensors.magnetometer.custom.field_world", horizontal, positive, "of a direction");
        require("sensors.magnetometer.custom.range", it.range, positive, "positive");
    }
    if let Some(it) = sensors.gnss() {
        require("sensors.gnss.custom.rate", it.rate, positive, "positive");
        require("sensors.gnss.custom.delay", it.delay, delay, DELAY);
        require("sensors.gnss.custom.position_cep", it.position_cep, positive, "positive");
        require("sensors.gnss.custom.dropout", it.dropout, share, SHARE);
    }
    if let Some(it) = sensors.capture() {
        require("sensors.capture.custom.rate", it.rate, positive, "positive");
        require("sensors.capture.custom.delay", it.delay, delay, DELAY);
        let deviation = it.position_deviation;
        require("sensors.capture.custom.position_deviation", deviation, positive, "positive");
        require("sensors.capture.custom.dropout", it.dropout, share, SHARE);
    }
    checks
}

fn first_infinite_vector(scenario: &Scenario) -> Option<&'static str> {
    let Scenario { vehicle, initial, disturbance, .. } = scenario;
    let mut vectors = vec![
        ("vehicle.inertia", vehicle.inertia),
        ("initial.position", initial.position),
        ("initial.velocity", initial.velocity),
        ("initial.rate_body", initial.rate_body),
    ];
    if let Some(constant) = disturbance.constant {
        vectors.push(("disturbance.constant.acceleration", constant.acceleration));
        vectors.push(("disturbance.constant.torque", constant.torque));
    }
    if let Some(sinusoid) = disturbance.sinusoid {
        vectors.push(("disturbance.sinusoid.acceleration", sinusoid.acceleration));
        vectors.push(("disturbance.sinusoid.torque", sinusoid.torque));
    }
    vectors.into_iter().find(|(_, vector)| !vector.is_finite()).map(|(path, _)| path)
}

pub(super) fn broken_assumptions(scenario: &Scenario) -> Vec<String> {
    let known = scenario.controller.uncertainty();
    let mut broken = Vec::new();
    let mut demand = |holds: bool, sentence: String| {
        if !holds {
            broken.push(sentence);
        }
    };
    let mass = scenario.vehicle.mass as f32;
    demand(
        known.mass.contains(mass),
        format!("true mass {mass} kg is outside [{}, {}] kg", known.mass.lower, known.mass.upper),
    );
    let inertia = scenario.vehicle.inertia.as_vec3().to_array();
    for (inertia, set) in inertia.into_iter().zip(known.inertia.axes()) {
        let Interval { lower, upper } = set;
        demand(
            set.contains(inertia),
            format!("true inertia {inertia} kg m^2 is outside [{lower}, {upper}] kg m^2"),
        );
    }
    let integral = scenario.controller.integral();
    let (acceleration, torque) = scenario.disturbance.bounds_beside(integral);
    let d1 = known.disturbance_acceleration;
    demand(
        acceleration as f32 <= d1,
        format!("disturbance acceleration up to {acceleration} m/s^2 exceeds D1 = {d1} m/s^2"),
    );
    for (axis, torque, d2) in beyond(torque.as_vec3(), known.disturbance_torque) {
        demand(false, format!("disturbance torque up to {torque} N m{axis} exceeds D2 = {d2} N m"));
    }
    broken.extend(unlike_the_command(scenario));
    broken.extend(scenario.rotors.iter().flat_map(RotorsConfig::broken_assumptions));
    broken.extend(scenario.sensors.as_ref().map(|_| {
        "the controller receives an estimate by sensors in place of the true state".to_owned()
    }));
    if !scenario.state_feedback.is_exact() {
        broken.push("the controller receives the state with noise or latency".to_owned());
    }
    if !scenario.rate_filter.is_empty() {
        broken.push("the controller receives the body rate behind filters".to_owned());
    }
    broken
}

/// Axis, value and limit of each component of `x` above that of `limit`; one without a name when all are
/// alike.
fn beyond(x: Vec3, limit: Vec3) -> Vec<(&'static str, f32, f32)> {
    if x == Vec3::splat(x.x) && limit == Vec3::splat(limit.x) {
        return if x.x <= limit.x { vec![] } else { vec![("", x.x, limit.x)] };
    }
    let axes = [" about x", " about y", " about z"].into_iter();
    let pairs = x.to_array().into_iter().zip(limit.to_array());
    let all = axes.zip(pairs).map(|(axis, (x, limit))| (axis, x, limit));
    all.filter(|(_, x, limit)| x > limit).collect()
}

/// Deviations of the actuators from the command, one sentence each.
fn unlike_the_command(scenario: &Scenario) -> Vec<String> {
    let (law, actuation) = (&scenario.controller, scenario.effective_actuation());
    let mut sentences = Vec::new();
    let mut require = |limit: Option<f32>, bound: f64, unit: &str| {
        if let Some(limit) = limit.map(f64::from).filter(|&limit| limit < bound) {
            let asked = if bound.is_finite() { number(bound) } else { "any".to_owned() };
            let given = number(limit);
            sentences.push(format!(
                "the rotors are limited to {given} {unit}, the law may command {asked}"
            ));
        }
    };
    if let Some(limits) = actuation.limits() {
        let thrust =
            law.thrust_upper_bound().min(law.thrust_max().map(f64::from).unwrap_or(f64::INFINITY));
        require(limits.thrust_max, thrust, "N of thrust");
        if let Some(given) = limits.torque_max {
            let asked = law.torque_max().unwrap_or(Vec3::INFINITY);
            for (axis, asked, given) in beyond(asked, given) {
                let unit = format!("N m{}", if axis.is_empty() { " per axis" } else { axis });
                require(Some(given), asked.into(), &unit);
            }
        }
    }
    let acting = |time: Option<f64>| time.filter(|&time| time > 0.0).map(number);
    sentences.extend(
        acting(actuation.delay).map(|time| format!("commands act with a delay of {time} s")),
    );
    sentences.extend(acting(actuation.rotor_lag).map(|time| {
        format!("thrust and torque follow the command with a time constant of {time} s")
    }));
    sentences
}
