//! Alignment at rest: attitude from gravity and the magnetic field, gyro bias from the mean rate.

use glam::{Quat, Vec3};

use super::Estimator;
use super::measurement::InertialSample;
use super::state::EstimatorState;
use crate::rotation::{from_axes, renormalised};
use crate::sqrt::sqrt;
use crate::vehicle::{GRAVITY, VehicleState};

/// Cause of a failed alignment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NotAligned {
    /// Fewer samples than asked for.
    TooFew,
    /// The vehicle turns or shakes, or a sample was not finite.
    Moving,
    /// The mean specific force is not gravity's within 0.5 m/s^2.
    NotGravity,
    /// The magnetic field has no horizontal part.
    NoHeading,
}

/// Sums of the samples of a vehicle at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alignment {
    samples: u32,
    rate: Vec3,
    force: Vec3,
    field: Vec3,
    field_samples: u32,
    /// Sums of squares, of the difference from the first sample.
    first: InertialSample,
    rate_square: f32,
    force_square: f32,
}

/// Largest standard deviation of the rates of a vehicle at rest (rad/s).
const RATE_DEVIATION: f32 = 0.05;
/// Largest standard deviation of its specific force (m/s^2).
const FORCE_DEVIATION: f32 = 0.5;
/// Largest bias of a gyro (rad/s): a mean rate above it is motion.
const GYRO_BIAS: f32 = 0.2;

impl Alignment {
    /// Adds one inertial sample.
    pub fn add(&mut self, sample: &InertialSample) {
        if self.samples == 0 {
            self.first = *sample;
        }
        let rate = sample.rate_body - self.first.rate_body;
        let force = sample.specific_force_body - self.first.specific_force_body;
        self.samples = self.samples.saturating_add(1);
        self.rate += rate;
        self.force += force;
        self.rate_square += rate.length_squared();
        self.force_square += force.length_squared();
    }

    /// Adds one sample of the magnetic field, body axes.
    pub fn add_field(&mut self, field_body: Vec3) {
        self.field += field_body;
        self.field_samples = self.field_samples.saturating_add(1);
    }

    /// Samples so far.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean rate and specific force, if the vehicle was at rest over at least `samples` samples.
    fn means(&self, samples: u32) -> Result<InertialSample, NotAligned> {
        if self.samples < samples.max(2) {
            return Err(NotAligned::TooFew);
        }
        let n = self.samples as f32;
        let (rate, force) = (self.rate / n, self.force / n);
        let spread = |square: f32, mean: Vec3| square / n - mean.length_squared();
        let rate_bound = 3.0 * RATE_DEVIATION * RATE_DEVIATION;
        let force_bound = 3.0 * FORCE_DEVIATION * FORCE_DEVIATION;
        let still = spread(self.rate_square, rate) <= rate_bound
            && spread(self.force_square, force) <= force_bound;
        let rate_body = self.first.rate_body + rate;
        if !(still && rate_body.abs().max_element() <= GYRO_BIAS) {
            return Err(NotAligned::Moving);
        }
        let specific_force_body = self.first.specific_force_body + force;
        let excess = sqrt(specific_force_body.length_squared()) - GRAVITY;
        if excess.abs() <= 0.5 {
            Ok(InertialSample { rate_body, specific_force_body })
        } else {
            Err(NotAligned::NotGravity)
        }
    }
}

impl Estimator {
    /// The state of a vehicle that rested at `position_world` over at least `samples` samples. Without
    /// samples of the magnetic field the heading is zero and as uncertain as configured.
    ///
    /// # Errors
    /// The reason that the samples are not those of a vehicle at rest.
    pub fn aligned(
        &self,
        alignment: &Alignment,
        samples: u32,
        position_world: Vec3,
    ) -> Result<EstimatorState, NotAligned> {
        let mean = alignment.means(samples)?;
        let attitude = self.attitude(&mean, alignment)?;
        let mut state =
            self.start(&VehicleState { attitude, ..VehicleState::at_rest(position_world) });
        state.gyro_bias = mean.rate_body;
        state.rate_body = Vec3::ZERO;
        Ok(state)
    }

    /// Body to world: z along the specific force, heading by the field.
    fn attitude(&self, mean: &InertialSample, alignment: &Alignment) -> Result<Quat, NotAligned> {
        let force = mean.specific_force_body;
        let up = force / sqrt(force.length_squared());
        let seen = if alignment.field_samples == 0 { Vec3::X } else { alignment.field };
        let north = seen - seen.dot(up) * up;
        let (length, whole) = (north.length_squared(), seen.length_squared());
        let is_heading = length > 1e-4 * whole && whole > 0.0;
        if !is_heading {
            return Err(NotAligned::NoHeading);
        }
        let north = north / sqrt(length);
        // Rows of R: the world's axes in body axes, x along the field's horizontal direction first.
        let level = glam::Mat3::from_cols(north, up.cross(north), up).transpose();
        let field_to_world =
            if alignment.field_samples == 0 { Quat::IDENTITY } else { self.north_rotation() };
        renormalised(field_to_world * from_axes(&level)).ok_or(NotAligned::Moving)
    }
}
