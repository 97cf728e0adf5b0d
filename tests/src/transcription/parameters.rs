//! Inputs of a law: gains and known bounds, the vehicle's truth, one reference point.

use glam::DVec3;
use serde::{Deserialize, Deserializer};

use super::Law;
use super::rotation::Quaternion;

/// Gains and bounds of both controllers, under the symbols of the page (SI units).
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// `M1` (m/s^2).
    #[serde(rename = "M1")]
    pub m1: f64,
    /// `M2` (m/s^2).
    #[serde(rename = "M2")]
    pub m2: f64,
    /// `k1` (1/m).
    pub k1: f64,
    /// `k2` (s/m).
    pub k2: f64,
    /// `k3` about each axis (1/s).
    #[serde(with = "sim::per_axis")]
    pub k3: DVec3,
    /// `k4` about each axis: (N m s) for controller 1, (1/s) for controller 2.
    #[serde(with = "sim::per_axis")]
    pub k4: DVec3,
    /// `k5` (1/s), controller 2.
    pub k5: f64,
    /// `c`.
    pub c: f64,
    /// `gamma1`.
    pub gamma1: f64,
    /// `gamma2` about each axis.
    #[serde(with = "sim::per_axis")]
    pub gamma2: DVec3,
    /// `gamma3`, controller 2.
    pub gamma3: f64,
    /// `D1` (m/s^2).
    #[serde(rename = "D1")]
    pub d1: f64,
    /// `D2` about each axis (N m).
    #[serde(rename = "D2", with = "sim::per_axis")]
    pub d2: DVec3,
    /// `delta_1` (1/s).
    pub delta_1: f64,
    /// Floor of the translational smoothing width.
    pub delta_min_translation: f64,
    /// Floor of the rotational smoothing width.
    pub delta_min_rotation: f64,
    /// `[m_lo, m_hi]` (kg).
    pub m: [f64; 2],
    /// `[J_lo, J_hi]` about each axis (kg m^2).
    #[serde(rename = "J", deserialize_with = "ends")]
    pub j: [DVec3; 2],
    /// `M_tau` about each axis (N m), controller 2.
    #[serde(rename = "M_tau", with = "sim::per_axis")]
    pub m_tau: DVec3,
    /// `g` (m/s^2).
    pub g: f64,
    /// Integral action; off in the golden file.
    #[serde(default)]
    pub integral: IntegralGains,
    /// Model of rotors that lag; off in the golden file.
    #[serde(default)]
    pub rotors: RotorGains,
}

/// Two ends, each a number for all axes or a vector.
fn ends<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[DVec3; 2], D::Error> {
    #[derive(Deserialize)]
    struct End(#[serde(with = "sim::per_axis")] DVec3);
    Ok(<[End; 2]>::deserialize(deserializer)?.map(|End(end)| end))
}

/// Bounds and gains of the integral action, under the symbols of the page (SI units).
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IntegralGains {
    /// `D_c` (m/s^2).
    pub d_c: f64,
    /// `gamma_d` (m/s^2).
    pub gamma_d: f64,
    /// `D_t` (N m).
    pub d_t: f64,
    /// `gamma_t`: (N m) for controller 1, (1/s^2) for controller 2.
    pub gamma_t: f64,
}

/// The model of rotors that lag, under the symbols of the page; off while `lag` is zero.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RotorGains {
    /// `T` (s).
    pub lag: f64,
    /// `T_f` (s).
    pub residual_lag: f64,
    /// `dt`, for which a command is held (s).
    pub dt: f64,
}

impl Gains {
    /// Bounds of the components of `t_hat`, or of `s_hat`: `D_t/J_lo` to the precision in which the core
    /// holds it, so that both mean the same border.
    #[must_use]
    pub fn lasting_torque_bound(&self, law: Law) -> DVec3 {
        match law {
            Law::RobustAdaptive => DVec3::splat(self.integral.d_t),
            Law::Saturated => (self.integral.d_t / self.j[0]).as_vec3().as_dvec3(),
        }
    }
}

/// Position, velocity, attitude and body rate of the vehicle.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// `p` (m).
    pub p: DVec3,
    /// `v` (m/s).
    pub v: DVec3,
    /// `q`: body to world.
    pub q: Quaternion,
    /// `w` (rad/s).
    pub w: DVec3,
}

/// The reference at one instant.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferencePoint {
    /// `p_d` (m).
    pub p: DVec3,
    /// `p_d'` (m/s).
    pub v: DVec3,
    /// `p_d''` (m/s^2).
    pub a: DVec3,
    /// `p_d'''` (m/s^3).
    pub jerk: DVec3,
    /// `p_d''''` (m/s^4).
    pub snap: DVec3,
    /// `b2d`.
    pub b2: DVec3,
    /// `b2d'` (1/s).
    pub b2_dot: DVec3,
    /// `b2d''` (1/s^2).
    pub b2_ddot: DVec3,
}
