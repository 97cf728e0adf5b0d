//! Rotors of a vehicle: positions, spins, reaction torques and limits.

use glam::{Vec3, Vec4};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::MAX_ROTORS;
use crate::error::{Bound, ConfigError, require};
use crate::list::List;
use crate::vehicle::Interval;

/// Direction of rotation of a rotor, seen from above (from body +z).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Spin {
    /// Its reaction turns the body anticlockwise: positive yaw torque.
    #[default]
    Clockwise,
    /// Its reaction turns the body clockwise: negative yaw torque.
    Anticlockwise,
}

/// One rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Rotor {
    /// `r`: position relative to the centre of mass, body axes (m).
    pub position_body: Vec3,
    /// Direction of rotation.
    pub spin: Spin,
    /// `kappa`: reaction torque for each newton of thrust (m), positive.
    pub torque_ratio: f32,
    /// Thrust while it runs (N): `0 <= lower < upper`; the lower end is the idle thrust, at which the rotor
    /// keeps turning.
    pub thrust: Interval,
}

/// The rotors of a vehicle, in the order of the outputs.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RotorGeometry {
    /// Four to [`MAX_ROTORS`] rotors.
    pub rotors: List<Rotor, MAX_ROTORS>,
}

impl RotorGeometry {
    /// Four rotors `arm` (m) from the centre of mass on the diagonals, anticlockwise from the
    /// front left; front left and rear right turn clockwise.
    #[must_use]
    pub fn quad_x(arm: f32, torque_ratio: f32, thrust: Interval) -> Self {
        let d = arm * core::f32::consts::FRAC_1_SQRT_2;
        Self::quad([(d, d), (-d, d), (-d, -d), (d, -d)], torque_ratio, thrust)
    }

    /// Four rotors `arm` (m) from the centre of mass on the body axes, anticlockwise from the
    /// front; front and rear turn clockwise.
    #[must_use]
    pub fn quad_plus(arm: f32, torque_ratio: f32, thrust: Interval) -> Self {
        Self::quad([(arm, 0.0), (0.0, arm), (-arm, 0.0), (0.0, -arm)], torque_ratio, thrust)
    }

    fn quad(places: [(f32, f32); 4], torque_ratio: f32, thrust: Interval) -> Self {
        let spins = [Spin::Clockwise, Spin::Anticlockwise].into_iter().cycle();
        let rotors = places.into_iter().zip(spins).map(|((x, y), spin)| {
            let position_body = Vec3::new(x, y, 0.0);
            Rotor { position_body, spin, torque_ratio, thrust }
        });
        Self { rotors: List::taking(rotors) }
    }

    /// As many equal rotors as `spins`, evenly on a circle of radius `arm` (m), anticlockwise from
    /// `first_angle` (rad, from body x towards body y); at most [`MAX_ROTORS`] of them.
    ///
    /// A hexarotor whose spins alternate loses the balance of yaw with one rotor; in pairs
    /// (`[A, A, C, C, A, C]`, the PPNNPN of the literature) it keeps it for two of three failures, and an
    /// octorotor keeps it for all.
    #[must_use]
    pub fn ring(
        spins: &[Spin],
        arm: f32,
        first_angle: f32,
        torque_ratio: f32,
        thrust: Interval,
    ) -> Self {
        let step = core::f32::consts::TAU / spins.len().max(1) as f32;
        let rotors = spins.iter().enumerate().map(|(index, spin)| {
            let (sin, cos) = libm::sincosf(first_angle + step * index as f32);
            let position_body = Vec3::new(arm * cos, arm * sin, 0.0);
            Rotor { position_body, spin: *spin, torque_ratio, thrust }
        });
        Self { rotors: List::taking(rotors) }
    }
}

/// Column of `B`: (thrust, roll, pitch, yaw) for each newton of the rotor.
pub(super) fn effect(rotor: &Rotor) -> Vec4 {
    let Vec3 { x, y, .. } = rotor.position_body;
    let reaction = match rotor.spin {
        Spin::Clockwise => rotor.torque_ratio,
        Spin::Anticlockwise => -rotor.torque_ratio,
    };
    Vec4::new(1.0, y, -x, reaction)
}

pub(super) fn require_rotor(rotor: &Rotor) -> Result<(), ConfigError> {
    rotor.position_body.to_array().into_iter().try_for_each(|coordinate| {
        require(
            "rotors.position_body",
            coordinate,
            Bound::Inside(-100.0, 100.0),
            "distance from the centre of mass, m",
        )
    })?;
    let ratio = Bound::Inside(1e-6, 10.0);
    require("rotors.torque_ratio", rotor.torque_ratio, ratio, "reaction torque per thrust, m")?;
    let Interval { lower, upper } = rotor.thrust;
    require("rotors.thrust.upper", upper, Bound::Inside(1e-3, 1e4), "thrust of one rotor, N")?;
    require(
        "rotors.thrust.lower",
        lower,
        Bound::Inside(0.0, 0.9 * upper),
        "at most 0.9 of the upper limit",
    )
}
