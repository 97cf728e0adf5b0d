//! TEMP
mod random;
use ctrl_core::config::*;
use ctrl_core::controller::TrackingController;
use ctrl_core::robust_adaptive::RobustAdaptive;
use ctrl_core::saturated::Saturated;
use ctrl_core::vehicle::*;
use glam::Vec3;
use std::path::Path;
use step_record::{Answer, Record, Sample, Start};

const U: Uncertainty = Uncertainty {
    mass: Interval { lower: 0.7, upper: 1.0 },
    inertia: Interval { lower: 0.03, upper: 0.12 },
    disturbance_acceleration: 0.05,
    disturbance_torque: 0.05,
};
const I: InitialEstimate = InitialEstimate { mass: 0.75, inertia: Vec3::splat(0.06) };
const C: CascadeGains = CascadeGains {
    k1: 0.5,
    k2: 1.0,
    k3: 4.0,
    c: 0.01,
    m1: 4.0,
    m2: 4.0,
    gamma1: 0.05,
    delta_1: 0.1,
    delta_min_translation: 0.1,
    delta_min_rotation: 0.05,
};

fn main() {
    let out = std::env::args().nth(1).unwrap();
    let c1 = RobustAdaptiveConfig {
        step_period: 0.001,
        reference_acceleration_max: 0.25,
        uncertainty: U,
        initial: I,
        cascade: C,
        k4: 0.5,
        gamma2: 0.01,
    };
    let k1 = RobustAdaptive::new(&c1).unwrap();
    let c2 = SaturatedConfig {
        step_period: 0.001,
        reference_acceleration_max: 0.25,
        uncertainty: U,
        initial: I,
        cascade: CascadeGains { m1: 0.45, m2: 0.45, k3: 2.0, c: 0.001, ..C },
        k4: 4.0,
        k5: 0.5,
        gamma2: 0.01,
        gamma3: 0.01,
        thrust_max: 12.0,
        torque_max: 0.05,
    };
    let k2 = Saturated::new(&c2).unwrap();
    for (name, samples) in [("random", random::tumbling(2000)), ("hostile", random::hostile(2000))]
    {
        write(&Path::new(&out).join("robust-adaptive").join(name), c1, &k1, &samples);
        write(&Path::new(&out).join("saturated").join(name), c2, &k2, &samples);
    }
}
fn write<T: TrackingController>(folder: &Path, config: impl Record, c: &T, samples: &[Sample]) {
    std::fs::create_dir_all(folder).unwrap();
    let mut b = vec![];
    let mut sink = |w: u32| b.extend(w.to_le_bytes());
    config.write(&mut sink);
    Start::zero().write(&mut sink);
    for s in samples {
        s.write(&mut sink)
    }
    std::fs::write(folder.join("step-input.bin"), b).unwrap();
    let mut state = c.initial_state();
    let mut b = vec![];
    for s in samples {
        let o = c.step(&mut state, &s.vehicle, &s.reference);
        let [x, y, z] = o.wrench.torque_body.to_array();
        let a = Answer {
            wrench: [o.wrench.thrust, x, y, z].map(f32::to_bits),
            status: o.status.bits().into(),
            ticks: 0,
        };
        for w in a.wrench.into_iter().chain([a.status]) {
            b.extend(w.to_le_bytes());
        }
    }
    std::fs::write(folder.join("expected.bin"), b).unwrap();
}
