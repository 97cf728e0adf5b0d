//! Vectors, the vehicle's state and the reference, as C structs.

use core::mem::offset_of;

use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{Interval, VectorInterval, VehicleState};
use glam::{Quat, Vec3};

use crate::access::Sized32;

/// A vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconVector {
    /// First component.
    pub x: f32,
    /// Second component.
    pub y: f32,
    /// Third component.
    pub z: f32,
}

/// A quaternion, Hamilton's product, scalar `w`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconQuaternion {
    /// First component of the vector part.
    pub x: f32,
    /// Second component of the vector part.
    pub y: f32,
    /// Third component of the vector part.
    pub z: f32,
    /// Scalar part.
    pub w: f32,
}

/// A closed interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconInterval {
    /// Smallest value.
    pub lower: f32,
    /// Largest value.
    pub upper: f32,
}

/// A closed interval per body axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconVectorInterval {
    /// Smallest values.
    pub lower: GyrfalconVector,
    /// Largest values.
    pub upper: GyrfalconVector,
}

/// State of the vehicle at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconVehicleState {
    /// `sizeof(gyrfalcon_vehicle_state)`.
    pub struct_size: u32,
    /// Position of the centre of mass in the world frame (m).
    pub position_world: GyrfalconVector,
    /// Velocity of the centre of mass in the world frame (m/s).
    pub velocity_world: GyrfalconVector,
    /// Unit quaternion that takes body to world coordinates.
    pub attitude: GyrfalconQuaternion,
    /// Angular velocity in body axes (rad/s).
    pub rate_body: GyrfalconVector,
}

/// Desired motion at one tick, in the world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconReference {
    /// `sizeof(gyrfalcon_reference)`.
    pub struct_size: u32,
    /// Position (m).
    pub position_world: GyrfalconVector,
    /// Velocity (m/s).
    pub velocity_world: GyrfalconVector,
    /// Acceleration (m/s^2), each component at most `reference_acceleration_max`.
    pub acceleration_world: GyrfalconVector,
    /// Jerk (m/s^3).
    pub jerk_world: GyrfalconVector,
    /// Snap (m/s^4).
    pub snap_world: GyrfalconVector,
    /// Unit vector along the desired body y (left), orthogonal to acceleration plus gravity.
    pub left_world: GyrfalconVector,
    /// Its first derivative (1/s).
    pub left_rate_world: GyrfalconVector,
    /// Its second derivative (1/s^2).
    pub left_acceleration_world: GyrfalconVector,
}

impl Sized32 for GyrfalconVehicleState {}
impl Sized32 for GyrfalconReference {}

impl From<GyrfalconVector> for Vec3 {
    #[inline(always)]
    fn from(v: GyrfalconVector) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<Vec3> for GyrfalconVector {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<GyrfalconQuaternion> for Quat {
    #[inline(always)]
    fn from(q: GyrfalconQuaternion) -> Self {
        Self::from_xyzw(q.x, q.y, q.z, q.w)
    }
}

impl From<Quat> for GyrfalconQuaternion {
    #[inline(always)]
    fn from(q: Quat) -> Self {
        Self { x: q.x, y: q.y, z: q.z, w: q.w }
    }
}

impl From<GyrfalconInterval> for Interval {
    fn from(interval: GyrfalconInterval) -> Self {
        Self { lower: interval.lower, upper: interval.upper }
    }
}

impl From<GyrfalconVectorInterval> for VectorInterval {
    fn from(interval: GyrfalconVectorInterval) -> Self {
        Self { lower: interval.lower.into(), upper: interval.upper.into() }
    }
}

/// A C struct that is `struct_size` and then a core type, so that the step can use it in place: a copy
/// would cost a tenth of the step.
macro_rules! in_place {
    ($own:ident, $core:ident: $($field:ident),+) => {
        const _: () = assert!(size_of::<$own>() == size_of::<u32>() + size_of::<$core>());
        const _: () = assert!(align_of::<$own>() == align_of::<$core>());
        $(const _: () = assert!(
            offset_of!($own, $field) == size_of::<u32>() + offset_of!($core, $field)
        );)+

        impl $own {
            /// The core's view of it.
            #[inline(always)]
            pub(crate) fn as_core(&self) -> &$core {
                // SAFETY: the core type lies behind `struct_size`, field by field, as asserted above; its
                // alignment is the same, and any bits are numbers.
                unsafe { &*(&raw const *self).byte_add(size_of::<u32>()).cast() }
            }
        }
    };
}

in_place!(
    GyrfalconVehicleState,
    VehicleState: position_world, velocity_world, attitude, rate_body
);
in_place!(
    GyrfalconReference,
    Reference: position_world, velocity_world, acceleration_world, jerk_world, snap_world, left_world,
    left_rate_world, left_acceleration_world
);
const _: () = assert!(offset_of!(GyrfalconQuaternion, w) == offset_of!(Quat, w));
const _: () = assert!(offset_of!(GyrfalconQuaternion, x) == offset_of!(Quat, x));
const _: () = assert!(offset_of!(GyrfalconQuaternion, z) == offset_of!(Quat, z));
const _: () = assert!(offset_of!(GyrfalconVector, z) == offset_of!(Vec3, z));

impl From<&VehicleState> for GyrfalconVehicleState {
    fn from(state: &VehicleState) -> Self {
        Self {
            struct_size: Self::SIZE,
            position_world: state.position_world.into(),
            velocity_world: state.velocity_world.into(),
            attitude: state.attitude.into(),
            rate_body: state.rate_body.into(),
        }
    }
}

impl From<&Reference> for GyrfalconReference {
    fn from(reference: &Reference) -> Self {
        Self {
            struct_size: Self::SIZE,
            position_world: reference.position_world.into(),
            velocity_world: reference.velocity_world.into(),
            acceleration_world: reference.acceleration_world.into(),
            jerk_world: reference.jerk_world.into(),
            snap_world: reference.snap_world.into(),
            left_world: reference.left_world.into(),
            left_rate_world: reference.left_rate_world.into(),
            left_acceleration_world: reference.left_acceleration_world.into(),
        }
    }
}
