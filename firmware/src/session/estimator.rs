//! Estimator aboard: its configuration by the host, and the samples of the host's sensors.

use ctrl_core::controller::TrackingController;
use ctrl_core::estimator::{Estimator, EstimatorConfig};
use ctrl_core::vehicle::VehicleState;
use link::{EstimatorSetting, Rejection, Uplink};

use super::HostSession;
use crate::exchange::ControlStatus;
use crate::sensor::{HostSensors, SensorFrame};
use crate::state_sample::ArrivedState;

impl HostSession<'_> {
    /// Takes a part of the configuration, or puts the whole to use if the estimator accepts it.
    #[inline(never)]
    pub(super) fn set_estimator(&mut self, setting: &EstimatorSetting) -> Result<(), Rejection> {
        let config = &mut self.estimator;
        match *setting {
            EstimatorSetting::Inertial(noise) => config.inertial = noise,
            EstimatorSetting::Initial(deviations) => config.initial = deviations,
            EstimatorSetting::MagneticField(field) => config.magnetic_field_world = field,
            EstimatorSetting::BarometerBias(bias) => config.barometer_bias = bias,
            EstimatorSetting::Source(source, settings) => *config.source_mut(source) = settings,
            EstimatorSetting::Faults(limits) => config.faults = limits,
            EstimatorSetting::Use => {
                config.step_period = self.law.step_period();
                Estimator::new(config)?;
                self.switch_estimator(true);
            }
            EstimatorSetting::Off => self.switch_estimator(false),
        }
        Ok(())
    }

    fn switch_estimator(&mut self, by_sensors: bool) {
        (self.by_sensors, self.estimator_changed) = (by_sensors, true);
        // What came by the other way is no sample of this one.
        (self.arrived, self.sensors) = (None, HostSensors::NONE);
    }

    /// Takes samples of the host's sensors, unless their tick shows that they are late.
    pub(super) fn sense(&mut self, message: &Uplink, status: ControlStatus) {
        let flight_tick = status.flight_tick;
        match *message {
            _ if !self.by_sensors => {}
            Uplink::EstimatorStart(state) if status.on_ground() => {
                self.inertial_tick = 0;
                self.sensors.start(state);
            }
            Uplink::Inertial { tick, sample } if self.state_order.accept(tick, flight_tick) => {
                let missed = tick.saturating_sub(self.inertial_tick).saturating_sub(1);
                // A repeated sample is no second one.
                if tick > self.inertial_tick {
                    self.inertial_tick = tick;
                    self.sensors.put_inertial(sample, missed);
                }
            }
            Uplink::Measured(measurement) => self.sensors.put(measurement),
            _ => {}
        }
    }

    /// What the host's sensors have given since it was last taken, if an inertial sample or a start is among it.
    pub fn take_frame(&mut self) -> Option<SensorFrame> {
        self.sensors.take()
    }

    /// The estimator's configuration after it has changed, once; none within to switch it off.
    pub fn take_estimator(&mut self) -> Option<Option<&EstimatorConfig>> {
        core::mem::take(&mut self.estimator_changed)
            .then_some(self.by_sensors.then_some(&self.estimator))
    }

    /// Takes the estimate at tick `uptime` as the state sample.
    pub fn put_estimate(&mut self, state: VehicleState, uptime: u32) {
        self.arrived = Some(ArrivedState { state, uptime });
    }
}
