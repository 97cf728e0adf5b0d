//! Frames as columns of rounded numbers, which is how a page reads them.

use serde::Serialize;

use super::frame::Frame;

/// Decimals of what a page shows; what is finer cannot be seen.
const MILLI: i32 = 3;
const TENTH_MILLI: i32 = 4;

/// A flight as columns, one value a frame. Three components of a vector are three columns.
#[derive(Clone, Debug, Serialize)]
pub struct Track {
    /// Time since the start (s).
    pub time: Vec<f64>,
    /// Position of the vehicle, world frame (m).
    pub position: [Vec<f64>; 3],
    /// Attitude, body to world, scalar first.
    pub attitude: [Vec<f64>; 4],
    /// Position of the reference, world frame (m).
    pub reference: [Vec<f64>; 3],
    /// Commanded thrust (N).
    pub thrust: Vec<f64>,
    /// Angle between body z and the thrust direction that the reference needs (rad).
    pub tilt_error: Vec<f64>,
}

impl Track {
    /// The columns of `frames`.
    #[must_use]
    pub fn new(frames: &[Frame]) -> Self {
        let column = |decimals: i32, value: &dyn Fn(&Frame) -> f64| -> Vec<f64> {
            frames.iter().map(|frame| rounded(value(frame), decimals)).collect()
        };
        let quaternion = |frame: &Frame| {
            let [x, y, z, w] = frame.attitude.to_array();
            [w, x, y, z]
        };
        Self {
            time: column(MILLI, &|frame| frame.time),
            position: [0, 1, 2].map(|i| column(MILLI, &|frame| frame.position_world[i])),
            attitude: [0, 1, 2, 3].map(|i| column(TENTH_MILLI, &|frame| quaternion(frame)[i])),
            reference: [0, 1, 2].map(|i| column(MILLI, &|frame| frame.reference_world[i])),
            thrust: column(MILLI, &|frame| frame.thrust),
            tilt_error: column(TENTH_MILLI, &|frame| frame.tilt_error),
        }
    }
}

/// `value` to so many decimals.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    #[test]
    fn columns_are_rounded_and_the_scalar_comes_first() {
        let frame = Frame {
            time: 0.1,
            position_world: DVec3::new(1.23456, -2.0, 1e-9),
            attitude: DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8),
            reference_world: DVec3::ZERO,
            thrust: 8.33333,
            tilt_error: 0.123456,
        };
        let track = serde_json::to_string(&Track::new(&[frame])).expect("plain numbers");
        assert_eq!(
            track,
            "{\"time\":[0.1],\"position\":[[1.235],[-2.0],[0.0]],\
             \"attitude\":[[0.8],[0.6],[0.0],[0.0]],\"reference\":[[0.0],[0.0],[0.0]],\
             \"thrust\":[8.333],\"tilt_error\":[0.1235]}"
        );
    }
}
