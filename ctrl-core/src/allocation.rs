//! Allocation of the commanded wrench to the rotors, and back.
//!
//! Every rotor pushes along body +z. With position `r_i`, thrust `f_i` and the reaction torque
//! `s_i kappa_i f_i` about body z (`s_i = 1` for a rotor that turns clockwise seen from above):
//!
//! ```text
//! (f, tau) = B (f_1 .. f_n),   column i of B = (1, y_i, -x_i, s_i kappa_i)
//! (f_1 .. f_n) = B^T (B B^T)^-1 (f, tau): the solution of least squares
//! ```
//!
//! If a rotor's limit does not allow that, roll and pitch torque come first, thrust second, yaw
//! torque last:
//!
//! 1. roll and pitch are scaled down together, only if no thrust makes room for them;
//! 2. the thrust is moved by as little as makes room for roll and pitch;
//! 3. yaw is scaled down to the room that is left.

use glam::{DMat4, DVec4, Vec3, Vec4};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Bound, ConfigError, require};
use crate::list::List;
use crate::sqrt::sqrt;
use crate::vehicle::{Interval, Wrench};

/// Most rotors of a vehicle.
pub const MAX_ROTORS: usize = 8;

/// Smallest `det(G)/(trace(G)/4)^4` of the row-scaled `G = B B^T`; 1 is the best geometry, and
/// below this f32 loses three digits.
const INDEPENDENCE_MIN: f32 = 1e-4;

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
    /// Thrust while it runs (N): `0 <= lower < upper`.
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
}

bitflags::bitflags! {
    /// Parts of the commanded wrench that the rotors' limits reduced.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
    pub struct Limited: u8 {
        /// Roll and pitch torque were scaled down.
        const ROLL_PITCH = 1 << 0;
        /// The thrust was moved.
        const THRUST = 1 << 1;
        /// The yaw torque was scaled down.
        const YAW = 1 << 2;
        /// The wrench was not finite; every rotor is at its lower limit.
        const INVALID = 1 << 3;
    }
}

/// The thrust of each rotor (N), in the order of the geometry.
pub type RotorThrusts = List<f32, MAX_ROTORS>;

/// Wrench to rotor thrusts, validated and prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocator {
    channels: List<Channel, MAX_ROTORS>,
}

/// One rotor as the allocator sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Channel {
    /// Column of `B`.
    effect: Vec4,
    /// Row of the pseudo-inverse, for (thrust, roll, pitch, yaw).
    share: Vec4,
    limits: Interval,
}

impl Allocator {
    /// Prepares the pseudo-inverse.
    ///
    /// # Errors
    /// Names a rotor field out of its range, or the geometry when it cannot produce thrust and the
    /// three torques independently, or needs a rotor to push less for more thrust.
    pub fn new(geometry: &RotorGeometry) -> Result<Self, ConfigError> {
        let count = Bound::Inside(4.0, MAX_ROTORS as f32);
        require("rotors (count)", geometry.rotors.len() as f32, count, "four axes; capacity")?;
        geometry.rotors.iter().try_for_each(require_rotor)?;
        let scale = row_scale(geometry);
        let inverse = inverse_gram(geometry, scale)?;
        let channels = geometry.rotors.iter().map(|rotor| {
            let effect = effect(rotor);
            let share = inverse * (effect.as_dvec4() / scale) / scale;
            Channel { effect, share: share.as_vec4(), limits: rotor.thrust }
        });
        let allocator = Self { channels: List::taking(channels) };
        for channel in &allocator.channels {
            let share = channel.share.x;
            require(
                "rotors (share of the thrust)",
                share,
                Bound::Positive,
                "more thrust must not need less of a rotor",
            )?;
        }
        Ok(allocator)
    }

    /// The rotor thrusts for `wrench`, each inside its limits, and what the limits took from it.
    ///
    /// Total: a wrench that is not finite gives the lower limits. To stop the rotors, do not come
    /// here: the lower limit of a running rotor may be above zero.
    #[must_use]
    pub fn allocate(&self, wrench: &Wrench) -> (RotorThrusts, Limited) {
        let command = wrench.torque_body.extend(wrench.thrust);
        let command = Vec4::new(command.w, command.x, command.y, command.z);
        if !command.is_finite() {
            return (self.thrusts(Vec4::ZERO), Limited::INVALID);
        }
        if self.channels.iter().all(|channel| channel.limits.contains(channel.share.dot(command))) {
            return (self.thrusts(command), Limited::empty());
        }
        let feasible = self.feasible(command);
        let mut limited = Limited::empty();
        limited.set(Limited::ROLL_PITCH, feasible.y != command.y || feasible.z != command.z);
        limited.set(Limited::THRUST, feasible.x != command.x);
        limited.set(Limited::YAW, feasible.w != command.w);
        (self.thrusts(feasible), limited)
    }

    /// The wrench that rotor thrusts (N) make; the rotors beyond the shorter list give none.
    #[must_use]
    pub fn wrench(&self, thrusts: &[f32]) -> Wrench {
        let pairs = self.channels.iter().zip(thrusts);
        let sum = pairs.fold(Vec4::ZERO, |sum, (channel, thrust)| sum + channel.effect * *thrust);
        Wrench { thrust: sum.x, torque_body: Vec3::new(sum.y, sum.z, sum.w) }
    }

    /// The thrusts for a (thrust, roll, pitch, yaw), clamped to the limits.
    fn thrusts(&self, command: Vec4) -> RotorThrusts {
        let thrust = |channel: &Channel| channel.limits.clamp(channel.share.dot(command));
        List::taking(self.channels.iter().map(thrust))
    }

    /// The command that the limits leave of (thrust, roll, pitch, yaw).
    fn feasible(&self, command: Vec4) -> Vec4 {
        let tilt = Vec4::new(0.0, command.y, command.z, 0.0);
        let tilt = tilt * self.tilt_scale(tilt);
        let (lowest, highest) = self.thrust_range(tilt);
        // The range is never empty but for rounding: the upper end then wins.
        let thrust = command.x.max(lowest).min(highest);
        let base = tilt + Vec4::X * thrust;
        let yaw = Vec4::W * command.w;
        base + yaw * self.yaw_scale(base, yaw)
    }

    /// The largest part of roll and pitch, up to 1, that some thrust makes room for.
    ///
    /// Rotor `i` at its lower and `j` at its upper limit bound the thrust from both sides; with
    /// `t` the tilt part and `s` the thrust share of each, the scale `k` must leave
    /// `(lower_i - k t_i)/s_i <= (upper_j - k t_j)/s_j`.
    fn tilt_scale(&self, tilt: Vec4) -> f32 {
        let mut scale = 1.0f32;
        for i in &self.channels {
            for j in &self.channels {
                let need = j.share.dot(tilt) / j.share.x - i.share.dot(tilt) / i.share.x;
                let room = j.limits.upper / j.share.x - i.limits.lower / i.share.x;
                if need > room {
                    scale = scale.min(room.max(0.0) / need);
                }
            }
        }
        scale
    }

    /// The interval of thrust (N) that keeps every rotor inside its limits beside `tilt`.
    fn thrust_range(&self, tilt: Vec4) -> (f32, f32) {
        self.channels.iter().fold((f32::MIN, f32::MAX), |(lowest, highest), channel| {
            let used = channel.share.dot(tilt);
            let low = (channel.limits.lower - used) / channel.share.x;
            let high = (channel.limits.upper - used) / channel.share.x;
            (lowest.max(low), highest.min(high))
        })
    }

    /// The largest part of `yaw`, up to 1, that fits beside `base`.
    fn yaw_scale(&self, base: Vec4, yaw: Vec4) -> f32 {
        self.channels.iter().fold(1.0, |scale, channel| {
            let (used, need) = (channel.share.dot(base), channel.share.dot(yaw));
            let limit = if need > 0.0 { channel.limits.upper } else { channel.limits.lower };
            let room = ((limit - used) / need).max(0.0); // NaN becomes 0: nothing to give
            if need == 0.0 { scale } else { scale.min(room) }
        })
    }
}

/// Throttle in [0, 1] for a thrust of `thrust` out of `thrust_max` (N), for a rotor whose thrust
/// grows with the square of its throttle.
///
/// ```
/// assert_eq!(ctrl_core::allocation::throttle(1.0, 4.0), 0.5);
/// ```
#[must_use]
pub fn throttle(thrust: f32, thrust_max: f32) -> f32 {
    let share = thrust / thrust_max;
    if share > 0.0 { sqrt(share.min(1.0)) } else { 0.0 }
}

impl Interval {
    /// The value inside nearest to `x`.
    fn clamp(&self, x: f32) -> f32 {
        x.max(self.lower).min(self.upper)
    }
}

/// Column of `B`: (thrust, roll, pitch, yaw) for each newton of the rotor.
fn effect(rotor: &Rotor) -> Vec4 {
    let Vec3 { x, y, .. } = rotor.position_body;
    let reaction = match rotor.spin {
        Spin::Clockwise => rotor.torque_ratio,
        Spin::Anticlockwise => -rotor.torque_ratio,
    };
    Vec4::new(1.0, y, -x, reaction)
}

/// The largest entry of each row of `B`, or 1 for a row of zeros.
fn row_scale(geometry: &RotorGeometry) -> DVec4 {
    let largest =
        geometry.rotors.iter().map(|rotor| effect(rotor).abs()).fold(Vec4::ZERO, Vec4::max);
    Vec4::select(largest.cmpgt(Vec4::ZERO), largest, Vec4::ONE).as_dvec4()
}

/// `G^-1` of the row-scaled `G = B B^T`.
fn inverse_gram(geometry: &RotorGeometry, scale: DVec4) -> Result<DMat4, ConfigError> {
    let mut gram = DMat4::ZERO;
    for rotor in &geometry.rotors {
        let v = effect(rotor).as_dvec4() / scale;
        gram += DMat4::from_cols(v * v.x, v * v.y, v * v.z, v * v.w);
    }
    let mean = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z + gram.w_axis.w) / 4.0;
    let independence = gram.determinant() / (mean * mean * mean * mean);
    let bound = Bound::AtLeast(INDEPENDENCE_MIN);
    require("rotors (independence)", independence as f32, bound, "thrust and three torques")?;
    Ok(gram.inverse())
}

fn require_rotor(rotor: &Rotor) -> Result<(), ConfigError> {
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

#[cfg(test)]
mod tests;
