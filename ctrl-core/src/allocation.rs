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
//! If that violates a rotor's limit, the thrusts of least squares within the limits are sought; if the
//! rotors cannot make the wrench at all, roll and pitch torque come first, thrust second, yaw torque last:
//!
//! 1. roll and pitch are scaled down together, only if no thrust and no yaw torque makes room for them;
//! 2. yaw torque is turned against its command only as far as roll and pitch need that;
//! 3. the thrust is moved by as little as makes room for both;
//! 4. yaw torque is what is nearest to its command then.
//!
//! A rotor that fails in flight is found by [`RotorWatch`] and [lost](Allocator::lose), one that has failed before [left out](Allocator::without), a supply voltage other than the nominal one
//! [scales the limits](Allocator::allocate_at), and [`ThrustCurve`] turns a thrust into a throttle.

mod attainable;
mod distribution;
mod geometry;
mod throttle;
mod watch;

pub use attainable::slabs;
pub use geometry::{Rotor, RotorGeometry, Spin};
pub use throttle::{BatteryCompensation, BatteryConfig, ThrustCurve, throttle};
pub use watch::{RotorWatch, RotorWatchConfig, RotorWatchState};

use glam::{DMat4, DVec4, Mat4, Vec3, Vec4};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::{Bound, ConfigError, require};
use crate::list::List;
use crate::vehicle::{Interval, Wrench};
use attainable::{Attainable, close, contains, farthest, reach};
use geometry::{effect, require_rotor};

/// Most rotors of a vehicle.
pub const MAX_ROTORS: usize = 8;

/// Smallest `det(G)/(trace(G)/4)^4` of the row-scaled `G = B B^T`; 1 is the best geometry, and
/// below this f32 loses three digits.
const INDEPENDENCE_MIN: f32 = 1e-4;

/// Largest scaled command that is told from a larger one: whatever it is, the rotors are at their limits.
const COMMAND_MAX: f32 = 1e6;

/// Scaled residual with which the clipped thrusts of least squares are good enough.
const ENOUGH: f32 = 5e-6;

/// Most tangents at the thrusts beside a tilt torque; each comes closer to the highest, or ends at it.
const TANGENTS: usize = 4;

/// Smallest part of the nominal thrust that a supply is taken to leave.
const SUPPLY_MIN: f32 = 0.1;

bitflags::bitflags! {
    /// Parts of the commanded wrench that the rotors' limits reduced.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
    pub struct Limited: u8 {
        /// Roll and pitch torque were scaled down.
        const ROLL_PITCH = 1 << 0;
        /// The thrust was moved.
        const THRUST = 1 << 1;
        /// The yaw torque was changed.
        const YAW = 1 << 2;
        /// The wrench was not finite; every rotor is at its lower limit.
        const INVALID = 1 << 3;
        /// A rotor has failed: the flight control says so, an allocation does not.
        const ROTOR_FAILED = 1 << 4;
    }
}

bitflags::bitflags! {
    /// A set of rotors, by their place in the order of the outputs.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
    pub struct RotorSet: u8 {
        /// The first rotor.
        const FIRST = 1 << 0;
        // Any other bit is a rotor, too.
        const _ = !0;
    }
}

impl RotorSet {
    /// The rotor at `index`; empty from [`MAX_ROTORS`] on.
    #[must_use]
    pub fn rotor(index: usize) -> Self {
        let bit = u32::try_from(index).ok().and_then(|index| 1u8.checked_shl(index));
        Self::from_bits_retain(bit.unwrap_or(0))
    }
}

/// The thrust of each rotor (N), in the order of the geometry.
pub type RotorThrusts = List<f32, MAX_ROTORS>;

/// Result of an allocation.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocation {
    /// Thrust of each rotor, inside its limits; zero for one that has failed.
    pub thrusts: RotorThrusts,
    /// The wrench that these thrusts make: the command, unless it was limited. Its torque is the one
    /// that acts in (37) when rotors, and not only the law, saturate.
    pub achieved: Wrench,
    /// What the limits took from the command.
    pub limited: Limited,
}

/// An allocator for any vehicle of up to [`MAX_ROTORS`] rotors.
pub type Allocator = SizedAllocator<{ slabs(MAX_ROTORS) }>;

/// An allocator for a vehicle of four rotors.
pub type QuadAllocator = SizedAllocator<{ slabs(4) }>;

/// An allocation that is compiled with this crate: an image whose other crates are built for size keeps the fast code.
pub trait Prepared {
    /// As [`SizedAllocator::allocate_at`].
    #[must_use]
    fn allocate_prepared(&self, wrench: &Wrench, supply: f32) -> Allocation;
}

macro_rules! prepared {
    ($($rotors:literal)*) => {$(
        impl Prepared for SizedAllocator<{ slabs($rotors) }> {
            #[inline(never)]
            fn allocate_prepared(&self, wrench: &Wrench, supply: f32) -> Allocation {
                self.allocate_at(wrench, supply)
            }
        }
    )*};
}
prepared!(4 5 6 7 8);

/// Wrench to rotor thrusts, validated and prepared, with memory for `SLABS` facets of the set of attainable
/// wrenches: [`slabs(n)`](slabs) are enough for `n` rotors.
#[derive(Clone, Debug, PartialEq)]
pub struct SizedAllocator<const SLABS: usize> {
    channels: List<Channel, MAX_ROTORS>,
    /// Largest entry of each row of `B`; divides (thrust, roll, pitch, yaw) to scaled wrenches.
    scale: Vec4,
    /// `(B B^T)^-1` of the scaled rows.
    inverse_gram: Mat4,
    attainable: Attainable<SLABS>,
}

/// One rotor as the allocator sees it; all zero for one that has failed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Channel {
    /// Column of `B`, each row scaled.
    column: Vec4,
    /// Row of the pseudo-inverse, for (thrust, roll, pitch, yaw).
    share: Vec4,
    limits: Interval,
}

impl<const SLABS: usize> SizedAllocator<SLABS> {
    /// Four rotors, whose thrusts follow from a wrench without a choice.
    const FOUR: bool = SLABS == slabs(4);

    /// Prepares the pseudo-inverse and the set of attainable wrenches.
    ///
    /// # Errors
    /// Names a rotor field out of its range, or the geometry when it cannot produce thrust and the
    /// three torques independently, or no thrust without torque.
    pub fn new(geometry: &RotorGeometry) -> Result<Self, ConfigError> {
        let new = Self::without(geometry, RotorSet::empty())?;
        let level = reach(new.attainable.wrench(), Vec4::ZERO, Vec4::X);
        require(
            "rotors (thrust without torque)",
            level.upper,
            Bound::AtLeast(level.lower.max(0.0) + f32::MIN_POSITIVE),
            "the centre of mass must lie among the rotors",
        )?;
        Ok(new)
    }

    /// As [`new`](Self::new), for a vehicle whose rotors in `failed` give nothing any more. The thrusts keep
    /// their places; a vehicle whose yaw is no longer in balance gives it up where roll, pitch and thrust
    /// need that.
    ///
    /// It takes some hundred thousand instructions: for a start, not for a control tick. In flight a rotor is
    /// [lost](Self::lose).
    ///
    /// # Errors
    /// As [`new`](Self::new), and when the rotors that are left cannot tilt the vehicle both ways about
    /// each axis.
    pub fn without(geometry: &RotorGeometry, failed: RotorSet) -> Result<Self, ConfigError> {
        let rotors = &geometry.rotors;
        let works = |index: usize| !failed.contains(RotorSet::rotor(index));
        let count = rotors.iter().enumerate().filter(|(index, _)| works(*index)).count() as f32;
        let enough = Bound::Inside(4.0, if Self::FOUR { 4.0 } else { MAX_ROTORS as f32 });
        require("rotors (count)", count, enough, "four axes; capacity")?;
        rotors.iter().try_for_each(require_rotor)?;
        let column = |index: usize, rotor: &Rotor| {
            if works(index) { effect(rotor).as_dvec4() } else { DVec4::ZERO }
        };
        let columns = rotors.iter().enumerate().map(|(index, rotor)| column(index, rotor));
        let scale = row_scale(columns.clone());
        let inverse = inverse_gram(columns.clone().map(|column| column / scale))?;
        let channels = columns.zip(rotors).map(|(column, rotor)| {
            let share = inverse * (column / scale) / scale;
            let limits = if column == DVec4::ZERO { Interval::default() } else { rotor.thrust };
            Channel { column: (column / scale).as_vec4(), share: share.as_vec4(), limits }
        });
        let mut new = Self {
            channels: List::taking(channels),
            scale: scale.as_vec4(),
            inverse_gram: inverse.as_mat4(),
            attainable: Attainable::new(),
        };
        let left = new.attainable.fill(&new.channels);
        let needed = SLABS as f32 + f32::from(left);
        require("rotors (facets)", needed, Bound::AtMost(SLABS as f32), "slabs(n) for n rotors")?;
        new.require_tilt()?;
        Ok(new)
    }

    /// Allocates to the other rotors from now on, in a bounded time and in place: the rotor at `index` gives
    /// nothing any more. It is [`without`](Self::without), to rounding; a rotor that was lost before stays lost.
    ///
    /// # Errors
    /// When there is no such rotor, or the rotors that are left are too few, not independent, or cannot tilt the vehicle both
    /// ways about each axis. Nothing has changed then.
    #[inline(never)]
    pub fn lose(&mut self, index: usize) -> Result<(), ConfigError> {
        let (channels, inverse) = (self.channels, self.inverse_gram);
        let result = self.replan_without(index);
        if result.is_err() {
            (self.channels, self.inverse_gram) = (channels, inverse);
            self.attainable.follow(&self.channels);
        }
        result
    }

    fn replan_without(&mut self, index: usize) -> Result<(), ConfigError> {
        let places = Bound::AtMost(self.channels.len() as f32 - 1.0);
        require("rotors (place)", index as f32, places, "from 0, in the order of the outputs")?;
        let Some(lost) = self.channels.get_mut(index).map(core::mem::take) else { return Ok(()) };
        if lost == Channel::default() {
            return Ok(());
        }
        let left = self.channels.iter().filter(|channel| channel.column != Vec4::ZERO).count();
        let enough = Bound::Inside(4.0, MAX_ROTORS as f32);
        require("rotors (count)", left as f32, enough, "four axes; capacity")?;
        let mut gram = Mat4::ZERO;
        // wcet: at most MAX_ROTORS iterations
        for Channel { column: v, .. } in &self.channels {
            gram += outer(*v, *v);
        }
        let mean = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z + gram.w_axis.w) * 0.25;
        let independence = gram.determinant() / (mean * mean * mean * mean);
        let bound = Bound::AtLeast(INDEPENDENCE_MIN);
        require("rotors (independence)", independence, bound, "thrust and three torques")?;
        // (G - v v^T)^-1 after Sherman and Morrison, and a Newton step against what that rounds off.
        let (before, v) = (self.inverse_gram, lost.column);
        let along = before * v;
        let inverse = before + outer(along, along) * (1.0 / (1.0 - v.dot(along)));
        self.inverse_gram = inverse * (Mat4::from_diagonal(Vec4::splat(2.0)) - gram * inverse);
        // wcet: at most MAX_ROTORS iterations
        for channel in &mut self.channels {
            channel.share = self.inverse_gram * channel.column / self.scale;
        }
        self.attainable.follow(&self.channels);
        self.require_tilt()
    }

    /// Roll and pitch torque both ways.
    fn require_tilt(&self) -> Result<(), ConfigError> {
        // wcet: at most 2 iterations
        for axis in [Vec4::Y, Vec4::Z] {
            let Interval { lower, upper } = reach(self.attainable.tilt(), Vec4::ZERO, axis);
            let way = if upper < -lower { upper } else { -lower };
            require("rotors (tilt torque)", way, Bound::Positive, "both ways about each axis")?;
        }
        Ok(())
    }

    /// The rotor thrusts for `wrench`, each inside its limits, with what the limits took from it.
    ///
    /// Total: a wrench that is not finite gives the lower limits. To stop the rotors, do not come
    /// here: the lower limit of a running rotor may be above zero. At most eight passes over the rotors and
    /// five over at most 56 slabs.
    #[must_use]
    pub fn allocate(&self, wrench: &Wrench) -> Allocation {
        self.allocate_at(wrench, 1.0)
    }

    /// As [`allocate`](Self::allocate), with every limit of the rotors scaled by `supply`, the thrust that the
    /// present voltage gives over the nominal one ([`BatteryCompensation`]); what is below 0.1, or not a
    /// number, counts as 0.1.
    #[must_use]
    pub fn allocate_at(&self, wrench: &Wrench, supply: f32) -> Allocation {
        let supply = if supply > SUPPLY_MIN { supply } else { SUPPLY_MIN };
        let command = Vec4::from((wrench.torque_body, wrench.thrust));
        let command = Vec4::new(command.w, command.x, command.y, command.z) * (1.0 / supply);
        if !command.is_finite() {
            return self.limited(self.thrusts(Vec4::ZERO), Limited::INVALID, supply);
        }
        let mut within = true;
        let thrusts = self.channels.iter().map(|channel| {
            let thrust = channel.share.dot(command);
            within &= channel.limits.contains(thrust);
            thrust * supply
        });
        // wcet: at most MAX_ROTORS iterations
        let thrusts = List::taking(thrusts);
        if within {
            return Allocation { thrusts, achieved: *wrench, limited: Limited::empty() };
        }
        let most = Vec4::splat(COMMAND_MAX);
        let wanted = (command / self.scale).clamp(-most, most);
        let feasible = self.feasible(wanted);
        let mut limited = Limited::empty();
        limited.set(Limited::ROLL_PITCH, feasible.y != wanted.y || feasible.z != wanted.z);
        limited.set(Limited::THRUST, feasible.x != wanted.x);
        limited.set(Limited::YAW, feasible.w != wanted.w);
        self.limited(self.thrusts(feasible), limited, supply)
    }

    fn limited(&self, thrusts: RotorThrusts, limited: Limited, supply: f32) -> Allocation {
        // wcet: at most MAX_ROTORS iterations
        let thrusts = List::taking(thrusts.iter().map(|thrust| thrust * supply));
        Allocation { achieved: self.wrench(&thrusts), thrusts, limited }
    }

    /// The wrench that rotor thrusts (N) make; the rotors beyond the shorter list give none.
    #[must_use]
    pub fn wrench(&self, thrusts: &[f32]) -> Wrench {
        let pairs = self.channels.iter().zip(thrusts);
        // wcet: at most MAX_ROTORS iterations
        let sum = pairs.fold(Vec4::ZERO, |sum, (channel, thrust)| sum + channel.column * *thrust);
        let sum = sum * self.scale;
        Wrench { thrust: sum.x, torque_body: Vec3::new(sum.y, sum.z, sum.w) }
    }

    /// The thrusts for a scaled wrench that the rotors can make, within the limits.
    fn thrusts(&self, wrench: Vec4) -> RotorThrusts {
        let multipliers = self.inverse_gram * wrench;
        let least_squares = distribution::clamped(&self.channels, wrench, multipliers);
        let left = least_squares.residual.abs().max_element();
        // Of four rotors' it is what rounding has left.
        if Self::FOUR || left <= ENOUGH * (1.0 + wrench.x.abs()) {
            return least_squares.thrusts;
        }
        let mut channels = self.channels;
        close(self.attainable.wrench(), wrench, &mut channels);
        distribution::distribute(&channels, wrench, multipliers)
    }

    /// The scaled wrench that the limits leave of `wanted`.
    fn feasible(&self, wanted: Vec4) -> Vec4 {
        let attainable = &self.attainable;
        if contains(attainable.wrench(), wanted) {
            return wanted;
        }
        let asked = Vec4::new(0.0, wanted.y, wanted.z, 0.0);
        let share = reach(attainable.tilt(), Vec4::ZERO, asked).clamp(1.0).max(0.0);
        let asked = asked * share;
        let yaws = reach(attainable.torque(), asked, Vec4::W);
        let thrust = self.thrust_beside(asked, wanted, yaws);
        let base = asked + Vec4::X * thrust;
        let yaw = reach(attainable.wrench(), base, Vec4::W).clamp(wanted.w);
        base + Vec4::W * yaw
    }

    /// The thrust nearest to the wanted one beside `tilt`, with a yaw torque between the one nearest to none
    /// and the one nearest to the wanted.
    fn thrust_beside(&self, tilt: Vec4, wanted: Vec4, yaws: Interval) -> f32 {
        let slabs = self.attainable.wrench();
        let thrusts = |yaw: f32| reach(slabs, tilt + Vec4::W * yaw, Vec4::X);
        let ends = [yaws.clamp(0.0), yaws.clamp(wanted.w)];
        // wcet: at most 2 iterations
        let [least, most] = ends.map(thrusts);
        // wcet: at most 2 iterations
        let too_much = [least, most].map(|thrusts| wanted.x > thrusts.upper);
        // wcet: at most 2 iterations
        let too_little = [least, most].map(|thrusts| wanted.x < thrusts.lower);
        match (too_much, too_little) {
            ([true, true], _) => {
                highest(ends, |yaw| farthest(slabs, tilt + Vec4::W * yaw, Vec4::X, Vec4::W))
                    .min(wanted.x)
            }
            (_, [true, true]) => {
                -highest(ends, |yaw| farthest(slabs, tilt + Vec4::W * yaw, -Vec4::X, Vec4::W))
                    .min(-wanted.x)
            }
            // Some yaw torque between the two makes room for it.
            _ => wanted.x,
        }
    }
}

/// The highest value of a concave, piecewise linear function between `ends`, from its value and slope: where
/// the tangents at both sides of it meet.
fn highest(ends: [f32; 2], function: impl Fn(f32) -> (f32, f32)) -> f32 {
    let ordered = if ends[0] <= ends[1] { ends } else { [ends[1], ends[0]] };
    // wcet: at most 2 iterations
    let [mut left, mut right] = ordered.map(|x| (x, function(x)));
    let mut best = left.1.0.max(right.1.0);
    // wcet: at most TANGENTS iterations
    for _ in 0..TANGENTS {
        let ((x, (y, rise)), (u, (v, fall))) = (left, right);
        let meeting = x + (v - y - fall * (u - x)) / (rise - fall);
        if !(rise > 0.0 && fall < 0.0 && x < meeting && meeting < u) {
            break;
        }
        let value = function(meeting);
        best = best.max(value.0);
        *(if value.1 > 0.0 { &mut left } else { &mut right }) = (meeting, value);
    }
    best
}

impl Interval {
    /// The value inside nearest to `x`; the middle, if the ends are in the wrong order.
    fn clamp(&self, x: f32) -> f32 {
        let Self { lower, upper } = *self;
        if lower > upper {
            0.5 * (lower + upper)
        } else if x > upper {
            upper
        } else if x > lower {
            x
        } else {
            lower // NaN, too
        }
    }
}

/// `a b^T`.
fn outer(a: Vec4, b: Vec4) -> Mat4 {
    Mat4::from_cols(a * b.x, a * b.y, a * b.z, a * b.w)
}

/// The largest entry of each row of `B`, or 1 for a row of zeros.
fn row_scale(columns: impl Iterator<Item = DVec4>) -> DVec4 {
    let largest = columns.map(|column| column.abs()).fold(DVec4::ZERO, DVec4::max);
    DVec4::select(largest.cmpgt(DVec4::ZERO), largest, DVec4::ONE)
}

/// `G^-1` of `G = B B^T` with scaled columns.
fn inverse_gram(columns: impl Iterator<Item = DVec4>) -> Result<DMat4, ConfigError> {
    let mut gram = DMat4::ZERO;
    for v in columns {
        gram += DMat4::from_cols(v * v.x, v * v.y, v * v.z, v * v.w);
    }
    let mean = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z + gram.w_axis.w) / 4.0;
    let independence = gram.determinant() / (mean * mean * mean * mean);
    let bound = Bound::AtLeast(INDEPENDENCE_MIN);
    require("rotors (independence)", independence as f32, bound, "thrust and three torques")?;
    Ok(gram.inverse())
}

#[cfg(test)]
mod tests;
