//! Step 2: from the commanded force to the desired attitude, its rate and acceleration.
//!
//! ```text
//! r3 = unit(alpha) = u/n, or R_a^T of it                                     (45)
//! r2 = unit( (r3.b3d) b2d - (r3.b2d) b3d )                                   (22)
//! r1 = r2 × r3,   R_d = [r1 r2 r3]                                           (23), (24)
//! w_d = vee(R_d^T R_d')                                                      (25)
//! ```
//! By the triple product, `(r3.b3d) b2d - (r3.b2d) b3d = r3 × (b2d × b3d)`. With
//! `B = b2d × (p_d'' + g e3)`, parallel to `b2d × b3d`, this is `r2 = unit(r3 × B)`, and only `B`, `B'`
//! and `B''` are needed of heading and reference. Neither of the two is normalised.
//!
//! Rate and acceleration follow without forming `r1'` to `r2''`. In the axes of `R_d`,
//! `r_i' = w_d × e_i`; let `B = [rho, 0, s]` (it has no `r2` component), `b = R_d^T B'`,
//! `p = R_d^T u'/n` and `P = R_d^T u''/n`. Differentiating `u = n r3` twice gives
//!
//! ```text
//! w_d.x = -p.y             w_d.x' = -(P.y - 2 p.z p.y) + w_d.z w_d.y
//! w_d.y =  p.x             w_d.y' =   P.x - 2 p.z p.x  - w_d.z w_d.x
//! ```
//! and differentiating `r2 . B = 0` twice
//!
//! ```text
//! w_d.z  = (b.y + s w_d.x)/rho
//! w_d.z' = (r2.B'' - w_d.z b.x + w_d.x b.z + s' w_d.x + s w_d.x' - rho' w_d.z)/rho
//! s' = rho w_d.y + b.z     rho' = b.x - s w_d.y
//! ```

use glam::{Mat3, Quat, Vec3};

use crate::jet::Jet;
use crate::reference::Reference;
use crate::rotation::{rotate, rotate_back, transpose_mul};
use crate::sqrt::sqrt;

/// Sine of the angle between `r3` and `B` below which the lateral axis counts as undefined.
///
/// `w_d.z` grows with its inverse: at 1/50 a gentle heading rate already asks for 50 times itself.
const SINGULAR_SINE: f32 = 0.02;

/// The desired attitude and its motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DesiredAttitude {
    /// `R_d`, or `R_a R_d` with an auxiliary attitude: desired axes in the world frame.
    pub axes_world: Mat3,
    /// `w_d` in the axes of `R_d` (rad/s).
    pub rate: Vec3,
    /// `w_d'` (rad/s^2).
    pub rate_dot: Vec3,
    /// The lateral axis `r2`, to be held where the next one is undefined.
    pub lateral: Vec3,
    /// `true` if it was held.
    pub held: bool,
}

/// `B = b2d × (p_d'' + g e3)` with its derivatives.
#[inline(always)]
fn heading_normal(reference: &Reference) -> Jet<Vec3> {
    reference.left().cross(reference.specific_force())
}

/// Evaluates step 2. `held_lateral` is the last `r2`; `auxiliary` is `q_a`, which counts as constant
/// when `R_d` is differentiated (deviation 12 of `docs/theory.md`).
#[inline(always)]
pub(crate) fn desired_attitude(
    u: &Jet<Vec3>,
    n: f32,
    reference: &Reference,
    held_lateral: Vec3,
    auxiliary: Option<Quat>,
) -> DesiredAttitude {
    let inverse_n = 1.0 / n;
    let r3_world = u.value * inverse_n;
    let r3 = auxiliary.map_or(r3_world, |q_a| rotate_back(q_a, r3_world));
    let normal = heading_normal(reference);

    let lateral = r3.cross(normal.value);
    let sine_squared = lateral.length_squared();
    let defined = sine_squared > SINGULAR_SINE * SINGULAR_SINE * normal.value.length_squared();
    let held = !defined;
    let (r2, rho, inverse_rho) = if held {
        // Zero times NaN or an infinity is NaN: a heading that is not finite must not pass as held.
        (orthogonal_to(r3, held_lateral), 0.0, 0.0 * sine_squared)
    } else {
        let rho = sqrt(sine_squared);
        let inverse_rho = 1.0 / rho;
        (lateral * inverse_rho, rho, inverse_rho) // (22)
    };
    let r1 = r2.cross(r3); // (23)
    let frame = Mat3::from_cols(r1, r2, r3);
    let axes_world = auxiliary.map_or(frame, |q_a| {
        let r2_world = rotate(q_a, r2);
        Mat3::from_cols(r2_world.cross(r3_world), r2_world, r3_world)
    });

    let u_dot = u.first * inverse_n;
    let p = transpose_mul(&axes_world, u_dot);
    let tilting = u.second * inverse_n - 2.0 * p.z * u_dot;
    let (x, y) = (-p.y, p.x); // (25)
    // The yaw rate that keeps r2 . B = 0; none while the lateral axis is held.
    let b = transpose_mul(&frame, normal.first);
    let s = r3.dot(normal.value);
    let z = (b.y + s * x) * inverse_rho;
    let x_dot = z * y - axes_world.y_axis.dot(tilting);
    let y_dot = axes_world.x_axis.dot(tilting) - z * x;
    let s_dot = rho * y + b.z;
    let rho_dot = b.x - s * y;
    let z_dot =
        (r2.dot(normal.second) - z * (b.x + rho_dot) + x * (b.z + s_dot) + s * x_dot) * inverse_rho;
    DesiredAttitude {
        axes_world,
        rate: Vec3::new(x, y, z),
        rate_dot: Vec3::new(x_dot, y_dot, z_dot),
        lateral: r2,
        held,
    }
}

/// The unit vector nearest to `held` that is orthogonal to the unit vector `axis`.
///
/// If `held` is itself along `axis`, any orthogonal vector serves: the smallest component of
/// `axis` picks one that is at least `sqrt(2/3)` away from it.
#[cold]
#[inline(never)]
fn orthogonal_to(axis: Vec3, held: Vec3) -> Vec3 {
    let rejected = held - axis.dot(held) * axis;
    let square = rejected.length_squared();
    if square > 1e-6 {
        return rejected * (1.0 / sqrt(square));
    }
    let size = axis.abs();
    let other = if size.x <= size.y && size.x <= size.z {
        Vec3::X
    } else if size.y <= size.z {
        Vec3::Y
    } else {
        Vec3::Z
    };
    let rejected = other - axis.dot(other) * axis;
    rejected * (1.0 / sqrt(rejected.length_squared()))
}
