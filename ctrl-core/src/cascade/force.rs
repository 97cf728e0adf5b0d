//! Step 1: from position error to the commanded force `alpha`, with its exact derivatives, and the
//! adaptation of the inverse mass.
//!
//! ```text
//! e_p = p - p_d            e_v = v - p_d'
//! L1  = k1 e_p + k2 e_v    L2  = k2 e_v
//! G   = k2 sig_1(L1) + k2 sig_2(L2) + k1 e_v                                  (16)
//! u   = -sig_1(L1) - sig_2(L2) - D1 h(G, delta) + g e3 + p_d''
//! alpha = u/beta                                                             (13)
//! f   = |alpha|                                                              (21)
//! beta' = Proj( gamma1 G . (f R e3) )                                        (14)
//! ```
//! With integral action, `u` less `d_hat`, `d_hat' = Proj( gamma_d [G_x, G_y, 0] )` (`integral.rs`), and
//! the model's `v'` has `d_hat` too.
//!
//! `u` is a closed form of `e_p`, `e_v` and time, so its derivatives follow exactly from the model's
//! `v'` and `v''`. With `n = |u| = beta f` these do not even contain `beta`, hence three passes, each
//! feeding the next:
//!
//! ```text
//! u   from p, v            v'  = -g e3 + n b3                                 (b3 = R e3)
//! u'  from v'              v'' = n' b3 + n b3'                 (b3' = R (w × e3), n' = u . u'/n)
//! u'' from v''
//! ```
//! The attitude needs the direction of `alpha` alone, which is that of `u`; `alpha'` and `alpha''`
//! themselves are formed for observers only.

use core::hint::cold_path;

use glam::{Mat3, Vec3};

use super::Cascade;
use crate::jet::Jet;
use crate::reference::Reference;
use crate::saturation::{Response, sigma, smooth_sign};
use crate::sqrt::sqrt;
use crate::vehicle::{GRAVITY, VehicleState};

/// The force command and what later steps need of its making.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceCommand {
    pub position_error: Vec3,
    pub velocity_error: Vec3,
    /// `|e_p|^2 + |e_v|^2`, kept in their place until the results are checked.
    pub error_square: f32,
    /// `G` and `G'`.
    pub g: Vec3,
    pub g_dot: Vec3,
    /// `u`, `u'`, `u''`: commanded specific force (m/s^2).
    pub u: Jet<Vec3>,
    /// `n = |u|` and its rate.
    pub n: f32,
    pub n_dot: f32,
    /// `f = |alpha| = n/beta` (N).
    pub thrust: f32,
    /// `beta'` (14).
    pub inverse_mass_rate: f32,
    /// `G . b3` and its rate.
    pub force_axis: (f32, f32),
    /// `d_hat'` (m/s^3); zero without integral action.
    pub lasting_rate: Vec3,
}

/// First pass: the errors and every nonlinearity evaluated at them.
struct Shaped {
    position_error: Vec3,
    velocity_error: Vec3,
    sigma1: Response,
    sigma2: Response,
    g: Vec3,
    sign: Response,
}

impl Shaped {
    #[inline(always)]
    fn new(
        law: &Cascade,
        delta_squared: f32,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> Self {
        let gains = &law.gains;
        let position_error = vehicle.position_world - reference.position_world;
        let velocity_error = vehicle.velocity_world - reference.velocity_world;
        let lambda2 = gains.k2 * velocity_error;
        let lambda1 = gains.k1 * position_error + lambda2;
        let sigma1 = sigma(lambda1, gains.m1);
        let sigma2 = sigma(lambda2, gains.m2);
        let g = gains.k2 * (sigma1.value + sigma2.value) + gains.k1 * velocity_error; // (16)
        let sign = smooth_sign(g, law.uncertainty.disturbance_acceleration, delta_squared); // (17)
        Self { position_error, velocity_error, sigma1, sigma2, g, sign }
    }

    /// `u` (13), given the reference's specific force `g e3 + p_d''`.
    #[inline(always)]
    fn command(&self, specific_force: Vec3) -> Vec3 {
        specific_force - (self.sigma1.value + self.sigma2.value) - self.sign.value
    }
}

/// A derivative of `e_p` with the next one, and what they make of `L1`, `L2`.
struct Motion {
    lambda1: Vec3,
    lambda2: Vec3,
}

impl Motion {
    /// The same combination for the errors and for each of their derivatives.
    #[inline(always)]
    fn new(law: &Cascade, lower: Vec3, upper: Vec3) -> Self {
        let lambda2 = law.gains.k2 * upper;
        Self { lambda1: law.gains.k1 * lower + lambda2, lambda2 }
    }
}

/// Evaluates step 1 at inverse mass `beta` and lasting acceleration `d_hat`; `r` is the matrix of the
/// vehicle's attitude.
#[inline(always)]
pub(crate) fn force_command(
    law: &Cascade,
    beta: f32,
    delta_squared: f32,
    d_hat: Vec3,
    vehicle: &VehicleState,
    r: &Mat3,
    reference: &Reference,
) -> ForceCommand {
    // First pass.
    let shaped = Shaped::new(law, delta_squared, vehicle, reference);
    if law.integral.force.is_some() {
        cold_path(); // the registers of a step without it are its own
        command::<true>(law, &shaped, beta, d_hat, vehicle, r, reference)
    } else {
        command::<false>(law, &shaped, beta, d_hat, vehicle, r, reference)
    }
}

/// Step 1 behind its first pass, once for each value of `INTEGRAL`.
///
/// `INTEGRAL` is whether the integral action of the force is on: without it, nothing of it is in the code.
#[inline(always)]
fn command<const INTEGRAL: bool>(
    law: &Cascade,
    shaped: &Shaped,
    beta: f32,
    d_hat: Vec3,
    vehicle: &VehicleState,
    r: &Mat3,
    reference: &Reference,
) -> ForceCommand {
    let gains = &law.gains;
    let specific_force = reference.specific_force();
    let integral = if INTEGRAL { law.integral.force.as_ref() } else { None };

    let mut u = shaped.command(specific_force.value); // (13)
    if INTEGRAL {
        u -= d_hat;
    }
    let n = sqrt(u.length_squared());
    let thrust = n / beta; // (21)

    // Second pass: u', with the model's v'.
    let b3 = r.z_axis;
    let mut error_2 = minus_gravity(n * b3) - reference.acceleration_world;
    let mut lasting_rate = Vec3::ZERO;
    if let Some(integral) = integral {
        error_2 += d_hat;
        lasting_rate = integral.rate(d_hat, horizontal(shaped.g));
    }
    let first = Motion::new(law, shaped.velocity_error, error_2);
    let sigma_dot = shaped.sigma1.first(first.lambda1) + shaped.sigma2.first(first.lambda2);
    let g_dot = gains.k2 * sigma_dot + gains.k1 * error_2;
    let mut u_dot = specific_force.first - sigma_dot - shaped.sign.first(g_dot);
    if INTEGRAL {
        u_dot -= lasting_rate;
    }
    let n_dot = u.dot(u_dot) / n;

    // Third pass: u'', with the model's v''.
    let rate = vehicle.rate_body;
    let b3_dot = rate.y * r.x_axis - rate.x * r.y_axis; // R (w × e3)
    let mut error_3 = n_dot * b3 + n * b3_dot - reference.jerk_world;
    if INTEGRAL {
        error_3 += lasting_rate;
    }
    let second = Motion::new(law, error_2, error_3);
    let sigma_ddot = shaped.sigma1.second(first.lambda1, second.lambda1)
        + shaped.sigma2.second(first.lambda2, second.lambda2);
    let g_ddot = gains.k2 * sigma_ddot + gains.k1 * error_3;
    let mut u_ddot = specific_force.second - sigma_ddot - shaped.sign.second(g_dot, g_ddot);
    if let Some(integral) = integral {
        u_ddot -= integral.rate_dot(lasting_rate, horizontal(g_dot));
    }

    let g = shaped.g;
    let force_axis = (g.dot(b3), g_dot.dot(b3) + g.dot(b3_dot));
    ForceCommand {
        position_error: shaped.position_error,
        velocity_error: shaped.velocity_error,
        error_square: shaped.position_error.length_squared()
            + shaped.velocity_error.length_squared(),
        g,
        g_dot,
        u: Jet::new(u, u_dot, u_ddot),
        n,
        n_dot,
        thrust,
        inverse_mass_rate: law.projected_rate(beta, gains.gamma1 * thrust * force_axis.0), // (14)
        force_axis,
        lasting_rate,
    }
}

impl ForceCommand {
    /// `alpha`, `alpha'` and `alpha''`, for observers.
    ///
    /// `alpha' = (u' - beta' alpha)/beta`, `alpha'' = (u'' - 2 beta' alpha' - beta'' alpha)/beta`,
    /// and `beta'' = gamma1 (f G . b3)'` unless the projection holds `beta`.
    pub fn alpha(&self, law: &Cascade, beta: f32) -> Jet<Vec3> {
        let rate = self.inverse_mass_rate;
        let value = self.u.value / beta;
        let first = (self.u.first - rate * value) / beta;
        let thrust_dot = (self.n_dot - rate * self.thrust) / beta;
        let (along, along_dot) = self.force_axis;
        let acceleration = if rate == 0.0 {
            0.0
        } else {
            law.gains.gamma1 * (thrust_dot * along + self.thrust * along_dot)
        };
        let second = (self.u.second - 2.0 * rate * first - acceleration * value) / beta;
        Jet::new(value, first, second)
    }
}

/// `[a_x, a_y, 0]`.
#[inline(always)]
fn horizontal(a: Vec3) -> Vec3 {
    Vec3::new(a.x, a.y, 0.0)
}

/// `a - g e3`.
#[inline(always)]
fn minus_gravity(a: Vec3) -> Vec3 {
    Vec3::new(a.x, a.y, a.z - GRAVITY)
}
