//! Estimator aboard, in the state-input group: takes the sensors' frame of a tick and gives the state that the law flies by.

use ctrl_core::controller::AdaptiveController;
use ctrl_core::error::ConfigError;
use ctrl_core::estimator::{
    Estimate, Estimator, EstimatorConfig, EstimatorState, InertialSample, RESTART_SHARE,
    ReferenceShift,
};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;

use crate::exchange::ControlStatus;
use crate::sensor::SensorFrame;
use crate::session::HostSession;

/// Missed inertial samples that one step makes up for; the estimate is later by each one beyond.
pub const MISSED_MAX: u64 = 2;
/// In place of an inertial sample that has not come: refused as not finite, so that the last good one is held, with
/// more noise, and the estimate's time goes on.
const MISSING: InertialSample =
    InertialSample { rate_body: Vec3::NAN, specific_force_body: Vec3::NAN };

/// The estimator with its state, off until it is configured.
///
/// Kilobytes: a static, changed in place.
#[derive(Clone, Debug)]
pub struct OnboardNavigation {
    estimator: Option<Estimator>,
    state: EstimatorState,
    shift: ReferenceShift,
    started: bool,
}

impl OnboardNavigation {
    /// Off: the vehicle flies by the states that its host sends. All zero, so that a static of it takes no flash.
    #[must_use]
    pub const fn new() -> Self {
        let shift = ReferenceShift::new(0.0); // that of the flight comes with its start
        Self { estimator: None, state: EstimatorState::BLANK, shift, started: false }
    }

    /// Takes what the session has for the estimator, at most one frame a release, and gives it the estimate.
    pub fn serve(&mut self, session: &mut HostSession<'_>, status: ControlStatus) {
        if let Some(config) = session.take_estimator() {
            // Checked by the session: a refusal leaves the estimator off.
            let _ = self.configure(config);
        }
        if let Some(frame) = session.take_frame() {
            let reference_acceleration_max = session.law().reference_acceleration_max();
            if let Some(state) = self.step(&frame, reference_acceleration_max) {
                session.put_estimate(state, status.uptime);
            }
        }
    }

    /// Puts a configuration in force, or switches off; the estimate begins with the next start.
    ///
    /// # Errors
    /// The field that the estimator refuses; it is then off.
    #[inline(never)]
    pub fn configure(&mut self, config: Option<&EstimatorConfig>) -> Result<(), ConfigError> {
        self.started = false;
        self.estimator = None;
        if let Some(config) = config {
            self.estimator = Some(Estimator::new(config)?);
        }
        Ok(())
    }

    /// `true` if the vehicle flies by its sensors.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.estimator.is_some()
    }

    /// A start, or one control tick: at most one prediction, with those that were missed, and one correction of each
    /// source. References may accelerate by up to `reference_acceleration_max` (m/s^2). None before the first start.
    #[inline(never)]
    pub fn step(
        &mut self,
        frame: &SensorFrame,
        reference_acceleration_max: f32,
    ) -> Option<VehicleState> {
        let estimator = self.estimator.as_ref()?;
        let state = &mut self.state;
        if let Some(vehicle) = &frame.start {
            estimator.start_in(state, vehicle);
            self.shift = ReferenceShift::new(RESTART_SHARE * reference_acceleration_max);
            self.started = true;
            return Some(state.vehicle());
        }
        if !self.started {
            return None;
        }
        // wcet: at most MISSED_MAX iterations
        for _ in 0..frame.missed.min(MISSED_MAX) {
            estimator.predict(state, &MISSING);
        }
        estimator.predict(state, frame.inertial.as_ref().unwrap_or(&MISSING));
        // wcet: at most MEASUREMENTS iterations
        for measurement in frame.measurements.iter().flatten() {
            estimator.correct(state, measurement);
        }
        self.shift.advance(state.restart(), estimator.step_period());
        Some(state.vehicle())
    }

    /// Shifts a reference with the restarts of the estimate.
    pub fn shift(&self, reference: &mut Reference) {
        if self.started {
            self.shift.apply(reference);
        }
    }

    /// The estimate with validity, faults and deviations; none while off.
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate> {
        self.estimator.as_ref().map(|estimator| estimator.estimate(&self.state))
    }
}

impl Default for OnboardNavigation {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::HostSensors;
    use ctrl_core::estimator::Measurement;
    use ctrl_core::vehicle::GRAVITY;

    fn frame(index: u32) -> SensorFrame {
        let noise = 1e-4 * ((index % 7) as f32 - 3.0);
        let mut sensors = HostSensors::NONE;
        let specific_force_body = Vec3::new(noise, 0.0, GRAVITY);
        sensors
            .put_inertial(InertialSample { rate_body: Vec3::splat(noise), specific_force_body }, 0);
        if index.is_multiple_of(10) {
            sensors.put(Measurement::CapturePosition(Vec3::new(0.3, noise, 1.0)));
        }
        sensors.take().unwrap()
    }

    fn start(at: Vec3) -> SensorFrame {
        SensorFrame { start: Some(VehicleState::at_rest(at)), ..SensorFrame::default() }
    }

    fn started() -> OnboardNavigation {
        let mut navigation = OnboardNavigation::new();
        navigation.configure(Some(&EstimatorConfig::EXAMPLE)).unwrap();
        assert!(navigation.step(&start(Vec3::Z), 0.3).is_some());
        navigation
    }

    #[test]
    fn off_or_not_started_it_gives_nothing() {
        let mut navigation = OnboardNavigation::new();
        assert!(!navigation.is_on() && navigation.step(&frame(1), 0.3).is_none());
        navigation.configure(Some(&EstimatorConfig::EXAMPLE)).unwrap();
        assert!(navigation.is_on() && navigation.step(&frame(1), 0.3).is_none());
        navigation.configure(None).unwrap();
        assert!(!navigation.is_on());
        let bad = EstimatorConfig { step_period: 0.0, ..EstimatorConfig::EXAMPLE };
        assert_eq!(navigation.configure(Some(&bad)).unwrap_err().parameter, "step_period");
        assert!(!navigation.is_on());
    }

    #[test]
    fn it_settles_on_what_its_sensors_see() {
        let mut navigation = started();
        let last =
            (0..3_000).filter_map(|index| navigation.step(&frame(index), 0.3)).last().unwrap();
        assert!((last.position_world - Vec3::new(0.3, 0.0, 1.0)).length() < 0.01, "{last:?}");
        assert_eq!(navigation.estimate().unwrap().inertial_fault, None);
    }

    #[test]
    fn missed_samples_are_held_and_the_time_of_the_estimate_goes_on() {
        let mut navigation = started();
        (0..3_000).for_each(|index| _ = navigation.step(&frame(index), 0.3));
        let mut held = navigation.clone();
        let next = frame(1);
        assert!(held.step(&SensorFrame { missed: 2, ..next }, 0.3).is_some());
        assert_eq!(held.estimate().unwrap().inertial_fault, None);
        // Two more steps of the velocity.
        navigation.step(&next, 0.3);
        let [alone, with] = [navigation, held].map(|it| it.estimate().unwrap());
        let moved = with.vehicle.position_world - alone.vehicle.position_world;
        assert!((moved - 2e-3 * alone.vehicle.velocity_world).length() < 1e-5, "{moved}");
        assert!(moved != Vec3::ZERO);
    }

    #[test]
    fn a_start_forgets_the_flight_before() {
        let (mut used, mut new) = (started(), started());
        (0..500).for_each(|index| _ = used.step(&frame(index), 0.3));
        assert_eq!(used.step(&start(Vec3::X), 0.3), new.step(&start(Vec3::X), 0.3));
        for index in 0..500 {
            assert_eq!(used.step(&frame(index), 0.3), new.step(&frame(index), 0.3), "{index}");
        }
    }

    #[test]
    fn a_restart_of_the_estimate_shifts_the_reference_and_the_way_back_ends() {
        let mut navigation = started();
        (0..1_000).for_each(|index| _ = navigation.step(&frame(index), 0.3));
        let aside = |index| {
            let mut frame = frame(index);
            for measurement in frame.measurements.iter_mut().flatten() {
                *measurement =
                    Measurement::CapturePosition(Vec3::new(0.3, 1e-4 * (index % 7) as f32, 3.0));
            }
            frame
        };
        let shifted = |navigation: &OnboardNavigation| {
            let mut reference = Reference::hover(Vec3::Z);
            navigation.shift(&mut reference);
            reference.position_world.z - 1.0
        };
        assert_eq!(shifted(&navigation), 0.0);
        let mut largest = 0.0f32;
        for index in 0..20_000 {
            navigation.step(&aside(index), 0.3);
            largest = largest.max(shifted(&navigation));
        }
        assert!((largest - 2.0).abs() < 0.1, "{largest}");
        assert_eq!(shifted(&navigation), 0.0);
    }
}
