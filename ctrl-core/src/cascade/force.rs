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
//! `alpha` is a closed form of `e_p`, `e_v`, `beta` and time, so its derivatives follow exactly from
//! the model's `v'` and `v''`. Hence three passes, each feeding the next:
//!
//! ```text
//! alpha   from p, v            v'  = -g e3 + beta f b3                        (b3 = R e3)
//! alpha'  from v'              v'' = (beta' f + beta f') b3 + beta f b3'      (b3' = R (w × e3))
//! alpha'' from v''             f'  = alpha . alpha'/f
//! ```

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
    /// `G` and `G'`.
    pub g: Vec3,
    pub g_dot: Vec3,
    /// `alpha`, `alpha'`, `alpha''` [N].
    pub alpha: Jet<Vec3>,
    /// `f = |alpha|` [N].
    pub thrust: f32,
    /// `f'` [N/s].
    pub thrust_dot: f32,
    /// `beta'` (14).
    pub inverse_mass_rate: f32,
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
        let sign = smooth_sign(g, delta_squared); // (17)
        Self { position_error, velocity_error, sigma1, sigma2, g, sign }
    }

    /// `u = beta alpha` (13), given the reference's specific force `g e3 + p_d''`.
    #[inline(always)]
    fn command(&self, law: &Cascade, specific_force: Vec3) -> Vec3 {
        specific_force
            - (self.sigma1.value + self.sigma2.value)
            - law.uncertainty.disturbance_acceleration * self.sign.value
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

/// Evaluates step 1 at inverse mass `beta`; `r` is the matrix of the vehicle's attitude.
#[inline(always)]
pub(crate) fn force_command(
    law: &Cascade,
    beta: f32,
    delta_squared: f32,
    vehicle: &VehicleState,
    r: &Mat3,
    reference: &Reference,
) -> ForceCommand {
    let gains = &law.gains;
    let d1 = law.uncertainty.disturbance_acceleration;
    let inverse_beta = 1.0 / beta;
    let specific_force = reference.specific_force();

    // First pass: alpha.
    let shaped = Shaped::new(law, delta_squared, vehicle, reference);
    let alpha = inverse_beta * shaped.command(law, specific_force.value); // (13)
    let thrust = sqrt(alpha.length_squared()); // (21)

    // Second pass: alpha', with the model's v'.
    let b3 = r.z_axis;
    let force_axis_gain = shaped.g.dot(b3);
    let wanted_rate = gains.gamma1 * thrust * force_axis_gain;
    let adapting = law.adapts(beta, wanted_rate);
    let inverse_mass_rate = if adapting { wanted_rate } else { 0.0 }; // (14)
    let acceleration = beta * thrust * b3 - GRAVITY * Vec3::Z;
    let error_2 = acceleration - reference.acceleration_world;
    let first = Motion::new(law, shaped.velocity_error, error_2);
    let sigma_dot = shaped.sigma1.first(first.lambda1) + shaped.sigma2.first(first.lambda2);
    let g_dot = gains.k2 * sigma_dot + gains.k1 * error_2;
    let command_dot = specific_force.first - sigma_dot - d1 * shaped.sign.first(g_dot);
    let alpha_dot = inverse_beta * (command_dot - inverse_mass_rate * alpha);
    let thrust_dot = alpha.dot(alpha_dot) / thrust;

    // Third pass: alpha'', with the model's v''.
    let rate = vehicle.rate_body;
    let b3_dot = rate.y * r.x_axis - rate.x * r.y_axis; // R (w × e3)
    let jerk = (inverse_mass_rate * thrust + beta * thrust_dot) * b3 + beta * thrust * b3_dot;
    let error_3 = jerk - reference.jerk_world;
    let second = Motion::new(law, error_2, error_3);
    let sigma_ddot = shaped.sigma1.second(first.lambda1, second.lambda1)
        + shaped.sigma2.second(first.lambda2, second.lambda2);
    let g_ddot = gains.k2 * sigma_ddot + gains.k1 * error_3;
    let command_ddot = specific_force.second - sigma_ddot - d1 * shaped.sign.second(g_dot, g_ddot);
    let inverse_mass_acceleration = if adapting {
        gains.gamma1
            * (thrust_dot * force_axis_gain + thrust * (g_dot.dot(b3) + shaped.g.dot(b3_dot)))
    } else {
        0.0
    };
    let alpha_ddot = inverse_beta
        * (command_ddot - 2.0 * inverse_mass_rate * alpha_dot - inverse_mass_acceleration * alpha);

    ForceCommand {
        position_error: shaped.position_error,
        velocity_error: shaped.velocity_error,
        g: shaped.g,
        g_dot,
        alpha: Jet::new(alpha, alpha_dot, alpha_ddot),
        thrust,
        thrust_dot,
        inverse_mass_rate,
    }
}
