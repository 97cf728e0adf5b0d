//! Bandwidth of the attitude against the torque that rate noise makes.

use super::design::design;
use super::hover::Hover;
use super::noise::activity;
use super::request::Request;

/// An attitude's bandwidth, and what it costs in torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trade {
    /// Bandwidth asked of the attitude (rad/s).
    pub attitude_bandwidth: f64,
    /// Slope of the smooth sign over `k4`, and torque activity (N m); none where there are no gains.
    pub met: Option<(f64, f64)>,
}

/// Bandwidths of the attitude in the table, over that of the request.
const TRADED: [f64; 5] = [0.5, 0.7, 1.0, 1.4, 2.0];

/// Torque activity of gains for other bandwidths of the attitude, the rest of `request` as it is.
#[must_use]
pub fn trade(request: &Request) -> Vec<Trade> {
    let row = |factor: f64| {
        let attitude_bandwidth = factor * request.wanted.attitude_bandwidth;
        let mut asked = request.clone();
        asked.options.attitude_bandwidth = Some(attitude_bandwidth);
        asked.options.noise_torque_max = None;
        asked.rate_noise = 0.0;
        let met = design(&asked.completed()).ok().map(|law| {
            let hover = Hover::new(&law);
            let slope = hover.slope_over_gain();
            let Request { rate_noise, rotors, rate_filter, .. } = request;
            (slope, activity(&law, *rate_noise, rotors, rate_filter).torque)
        });
        Trade { attitude_bandwidth, met }
    };
    TRADED.into_iter().map(row).collect()
}
