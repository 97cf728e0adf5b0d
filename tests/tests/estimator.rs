//! The estimator in `f32` and factors against its transcription in `f64` and full matrices.

use ctrl_core::estimator::{
    BarometerBias, Estimator, EstimatorConfig, EstimatorState, InertialSample, Measurement, Verdict,
};
use ctrl_core::vehicle::VehicleState;
use glam::{DQuat, DVec3, Vec3};
use system_tests::estimator_transcription::{STATES, Transcription};
use system_tests::random::Source;

/// Largest differences over a flight.
#[derive(Clone, Copy, Debug, Default)]
struct Differences {
    position: f64,
    velocity: f64,
    attitude: f64,
    /// Of any element of the covariance, in units of its two standard deviations.
    covariance: f64,
    /// Measurements for which the ground was out of sight.
    inapplicable: u32,
}

impl Differences {
    fn observe(&mut self, state: &EstimatorState, exact: &Transcription) {
        let vehicle = state.vehicle();
        let largest = |seen: &mut f64, x: f64| *seen = seen.max(x);
        largest(&mut self.position, (vehicle.position_world.as_dvec3() - exact.position).length());
        largest(&mut self.velocity, (vehicle.velocity_world.as_dvec3() - exact.velocity).length());
        let turn = vehicle.attitude.as_dquat().normalize().inverse() * exact.attitude;
        largest(&mut self.attitude, 2.0 * turn.xyz().length());
        for i in 0..STATES {
            for j in 0..STATES {
                let scale = (exact.covariance[i][i] * exact.covariance[j][j]).sqrt();
                let found = f64::from(state.covariance().element(i, j));
                largest(&mut self.covariance, (found - exact.covariance[i][j]).abs() / scale);
            }
        }
    }
}

/// Flies `seconds` of smooth motion with noise; every measurement of `kinds` at 50 Hz.
fn fly(seed: u64, seconds: u32, kinds: &[usize]) -> Differences {
    let mut config = EstimatorConfig::EXAMPLE;
    config.barometer_bias = BarometerBias { deviation: 0.5, walk: 0.02 };
    let estimator = Estimator::new(&config).unwrap();
    let start = VehicleState::at_rest(Vec3::new(1.0, -2.0, 3.0));
    let mut state = estimator.start(&start);
    let mut exact = Transcription::new(&config, &start);
    let mut source = Source::new(seed);
    let mut differences = Differences::default();
    let noise = |source: &mut Source, scale: f64| source.vector(-scale, scale).as_vec3();
    for step in 0..seconds * 1000 {
        let time = f64::from(step) * 1e-3;
        let rate = DVec3::new((1.3 * time).sin(), (0.9 * time).cos(), (0.7 * time).sin()) * 0.5;
        // A lemniscate's acceleration, seen from the exact estimate.
        let acceleration = DVec3::new(3.0 * (1.1 * time).cos(), 2.0 * (2.2 * time).sin(), 0.0);
        let force = exact.attitude.inverse() * (acceleration + 9.81 * DVec3::Z);
        let sample = InertialSample {
            rate_body: rate.as_vec3() + noise(&mut source, 0.01),
            specific_force_body: force.as_vec3() + noise(&mut source, 0.05),
        };
        estimator.predict(&mut state, &sample);
        exact.predict(&sample);
        if step % 20 == 0 && step >= 120 {
            // Near the exact estimate, so that the gate, which the transcription lacks, passes all.
            let kind = kinds[(step / 20) as usize % kinds.len()];
            let measurement = measured(kind, &exact, &mut source);
            let verdict = estimator.correct(&mut state, &measurement);
            match verdict {
                Verdict::Accepted { .. } => exact.correct(&measurement),
                // The ground is out of sight in tilts beyond 60 degrees.
                Verdict::Inapplicable => differences.inapplicable += 1,
                _ => panic!("{verdict:?} of {measurement:?}"),
            }
            differences.observe(&state, &exact);
        }
    }
    differences
}

fn measured(kind: usize, exact: &Transcription, source: &mut Source) -> Measurement {
    let noise = |source: &mut Source, scale: f64| source.vector(-scale, scale);
    let (displacement, gained, _) = exact.motion(0.1);
    let back = exact.position - displacement;
    match kind {
        0 => Measurement::Barometer((exact.position.z + source.number(-0.2, 0.2)) as f32),
        1 => Measurement::GnssPosition((back + noise(source, 0.5)).as_vec3()),
        2 => Measurement::GnssVelocity((exact.velocity - gained + noise(source, 0.03)).as_vec3()),
        3 => {
            let recent = exact.position - exact.motion(0.01).0;
            Measurement::CapturePosition((recent + noise(source, 1e-3)).as_vec3())
        }
        4 => {
            let turn = DQuat::from_scaled_axis(noise(source, 4e-3));
            let then = exact.attitude * exact.motion(0.01).2;
            Measurement::CaptureAttitude((turn * then).as_quat())
        }
        5 => {
            let field = DVec3::new(0.0, 20.0, -40.0) + noise(source, 0.2);
            Measurement::Magnetometer((exact.attitude.inverse() * field).as_vec3())
        }
        6 => {
            let (displacement, _, back) = exact.motion(0.01);
            let up = (exact.attitude * back) * DVec3::Z;
            let distance = (exact.position - displacement).z / up.z;
            Measurement::Rangefinder((distance + source.number(-0.02, 0.02)) as f32)
        }
        _ => {
            let (displacement, gained, back) = exact.motion(0.01);
            let then = exact.attitude * back;
            let distance = (exact.position - displacement).z / (then * DVec3::Z).z;
            let velocity = then.inverse() * (exact.velocity - gained) / distance;
            let bias = DVec3::new(exact.gyro_bias.y, -exact.gyro_bias.x, 0.0);
            let flow = velocity + bias + noise(source, 0.03);
            Measurement::OpticalFlow(flow.truncate().as_vec2())
        }
    }
}

#[test]
fn single_precision_factors_agree_with_full_matrices_in_double_precision() {
    // Near the ground nothing sees the horizontal position, and while the ground is out of sight, for a few seconds at
    // a time, nothing the velocity: there differences of tilt, 1e-4 rad of gravity, add up to millimetres.
    for (name, kinds, position, velocity) in [
        ("outdoors", &[0, 1, 2, 5, 1, 2][..], 1e-3, 1e-3),
        ("indoors", &[3, 4], 1e-3, 1e-3),
        ("near the ground", &[6, 7, 5, 7], 2e-2, 4e-3),
        ("all", &[0, 1, 2, 3, 4, 5, 6, 7], 1e-3, 1e-3),
    ] {
        for seed in 0..3 {
            let seconds = 30;
            let found = fly(seed, seconds, kinds);
            println!("{name}, seed {seed}: {found:?}");
            assert!(found.inapplicable < seconds * 50 / 2, "{name}: {found:?}");
            assert!(found.position < position, "{name}: {found:?}");
            assert!(found.velocity < velocity, "{name}: {found:?}");
            assert!(found.attitude < 2e-4, "{name}: {found:?}");
            // Noise that takes turns comes up to one step early or late, and here more than half of the velocity's
            // is by distortion, at accelerations up to 3.6 m/s^2.
            assert!(found.covariance < 4e-3, "{name}: {found:?}");
        }
    }
}
