//! What the figures show, reduced while the flight goes on: least and greatest value of every
//! channel in each pixel column, so that no peak is lost and memory does not grow with the flight.

use ctrl_core::controller::Auxiliary;
use glam::{DVec2, Vec3};

use crate::trace::inertia_estimate;
use sim::guarantee::tracking::{rotation_angle, tilt_error};
use sim::observer::Observer;
use sim::tick::Tick;

/// First index of each recorded quantity; vectors take three, `q_e` four (scalar first).
pub mod channel {
    /// `e_p` (m).
    pub const POSITION_ERROR: usize = 0;
    /// `q_e`.
    pub const ATTITUDE_ERROR: usize = 3;
    /// `f` (N).
    pub const THRUST: usize = 7;
    /// `tau` (N m).
    pub const TORQUE: usize = 8;
    /// `tau_d` (N m).
    pub const TORQUE_DEMAND: usize = 11;
    /// Mass estimate (kg).
    pub const MASS: usize = 14;
    /// Inertia estimate (kg m^2).
    pub const INERTIA: usize = 15;
    /// `w_a` (rad/s).
    pub const AUXILIARY_RATE: usize = 18;
    /// Angle of `q_a` (rad).
    pub const AUXILIARY_ANGLE: usize = 21;
    /// V less its first value.
    pub const LYAPUNOV: usize = 22;
    /// V without its parameter terms.
    pub const LYAPUNOV_STATE: usize = 23;
    /// Angle between body z and `b3d` (rad).
    pub const TILT: usize = 24;
    /// Height of vehicle and reference (m).
    pub const HEIGHT: usize = 25;
    /// How many there are.
    pub const COUNT: usize = 27;
}

/// One interval of the flight, cut into columns.
#[derive(Clone, Debug)]
pub struct Window {
    /// Its start (s).
    pub start: f64,
    /// Its end (s).
    pub end: f64,
    columns: Vec<Column>,
}

/// Least and greatest of every channel, and where vehicle and reference were last.
#[derive(Clone, Copy, Debug)]
struct Column {
    least: [f32; channel::COUNT],
    greatest: [f32; channel::COUNT],
    vehicle: DVec2,
    reference: DVec2,
}

impl Window {
    fn new(start: f64, end: f64, columns: usize) -> Self {
        let empty = Column {
            least: [f32::INFINITY; channel::COUNT],
            greatest: [f32::NEG_INFINITY; channel::COUNT],
            vehicle: DVec2::NAN,
            reference: DVec2::NAN,
        };
        Self { start, end, columns: vec![empty; columns] }
    }

    fn push(&mut self, tick: &Tick, values: &[f32; channel::COUNT]) {
        if !(self.start..=self.end).contains(&tick.time) {
            return;
        }
        let count = self.columns.len();
        let place = (tick.time - self.start) / (self.end - self.start) * count as f64;
        let Some(column) = self.columns.get_mut((place as usize).min(count - 1)) else { return };
        for ((least, greatest), value) in
            column.least.iter_mut().zip(&mut column.greatest).zip(values)
        {
            *least = if *value < *least { *value } else { *least };
            *greatest = if *value > *greatest { *value } else { *greatest };
        }
        column.vehicle = tick.truth.position_world.truncate();
        column.reference = tick.reference.position_world.as_dvec3().truncate();
    }

    /// A line over time that touches least and greatest value in every column.
    pub fn line(&self, channel: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        let width = (self.end - self.start) / self.columns.len() as f64;
        self.columns
            .iter()
            .enumerate()
            .filter(move |(_, column)| column.least[channel].is_finite())
            .flat_map(move |(index, column)| {
                let time = self.start + (index as f64 + 0.5) * width;
                let ends = [column.least[channel], column.greatest[channel]].map(f64::from);
                // Down and up in turn, so that the line does not zigzag between columns.
                let [first, second] = if index % 2 == 0 { ends } else { [ends[1], ends[0]] };
                [(time, first), (time, second)]
            })
    }

    /// The way of the vehicle and that of the reference over the ground (m).
    #[must_use]
    pub fn ground_tracks(&self) -> [Vec<(f64, f64)>; 2] {
        let track = |place: fn(&Column) -> DVec2| {
            let places = self.columns.iter().map(place).filter(|place| place.is_finite());
            places.map(|place| (place.x, place.y)).collect()
        };
        [track(|column| column.vehicle), track(|column| column.reference)]
    }
}

/// Records a flight for its figures.
#[derive(Clone, Debug)]
pub struct Recorder {
    /// The whole flight.
    pub whole: Window,
    /// Its first seconds.
    pub transient: Window,
    /// What follows the settling time, if anything does.
    pub settled: Option<Window>,
    /// V at the first tick.
    first_lyapunov: Option<f64>,
}

/// Length of the enlarged start of the flight (s).
pub const TRANSIENT: f64 = 20.0;

impl Recorder {
    /// For a flight of `duration` that settles within `settle_time` (s).
    #[must_use]
    pub fn new(duration: f64, settle_time: f64) -> Self {
        let duration = duration.max(f64::MIN_POSITIVE);
        let settled = settle_time < duration;
        Self {
            whole: Window::new(0.0, duration, 480),
            transient: Window::new(0.0, duration.min(TRANSIENT), 320),
            settled: settled.then(|| Window::new(settle_time, duration, 280)),
            first_lyapunov: None,
        }
    }
}

impl Observer for Recorder {
    fn observe(&mut self, tick: &Tick) {
        let evaluation = &tick.evaluation;
        let mut values = values(tick);
        let first = *self.first_lyapunov.get_or_insert(evaluation.value);
        values[channel::LYAPUNOV] = (evaluation.value - first) as f32;
        self.whole.push(tick, &values);
        self.transient.push(tick, &values);
        if let Some(settled) = &mut self.settled {
            settled.push(tick, &values);
        }
    }
}

fn values(tick: &Tick) -> [f32; channel::COUNT] {
    let evaluation = &tick.evaluation;
    let mut values = [0.0; channel::COUNT];
    let mut put = |channel: usize, vector: Vec3| {
        values[channel..channel + 3].copy_from_slice(&vector.to_array());
    };
    put(channel::POSITION_ERROR, evaluation.position_error.as_vec3());
    put(channel::ATTITUDE_ERROR + 1, evaluation.attitude_error.xyz().as_vec3());
    put(channel::TORQUE, tick.output.wrench.torque_body);
    put(channel::TORQUE_DEMAND, tick.output.torque_demand_body);
    put(channel::INERTIA, inertia_estimate(&tick.estimates).as_vec3());
    put(channel::AUXILIARY_RATE, tick.auxiliary.rate);
    let mut put = |channel: usize, value: f64| values[channel] = value as f32;
    put(channel::ATTITUDE_ERROR, evaluation.attitude_error.w);
    put(channel::THRUST, tick.output.wrench.thrust.into());
    put(channel::MASS, 1.0 / f64::from(tick.estimates.inverse_mass));
    if tick.auxiliary != Auxiliary::REST {
        put(channel::AUXILIARY_ANGLE, rotation_angle(tick.auxiliary.attitude.as_dquat()));
    }
    put(channel::LYAPUNOV_STATE, evaluation.value - evaluation.parameter_part);
    put(channel::TILT, tilt_error(tick.truth.attitude, &tick.reference));
    put(channel::HEIGHT, tick.truth.position_world.z);
    put(channel::HEIGHT + 1, tick.reference.position_world.z.into());
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window_of(values: impl Iterator<Item = (f64, f32)>) -> Window {
        let mut window = Window::new(0.0, 10.0, 5);
        for (time, value) in values {
            let index = ((time / 2.0) as usize).min(4);
            let column = &mut window.columns[index];
            column.least[0] = column.least[0].min(value);
            column.greatest[0] = column.greatest[0].max(value);
        }
        window
    }

    #[test]
    fn a_peak_of_one_tick_stays_in_the_line() {
        let ticks =
            (0..1000).map(|tick| (f64::from(tick) * 0.01, if tick == 437 { 9.0 } else { 1.0 }));
        let window = window_of(ticks);
        let line: Vec<_> = window.line(0).collect();
        assert_eq!(line.len(), 10);
        assert_eq!(line.iter().map(|(_, y)| *y).fold(0.0, f64::max), 9.0);
        assert_eq!(line.iter().find(|(_, y)| *y == 9.0).map(|(t, _)| *t), Some(5.0));
    }

    #[test]
    fn columns_without_a_tick_are_left_out() {
        let window = window_of([(1.0, 3.0)].into_iter());
        assert_eq!(window.line(0).collect::<Vec<_>>(), [(1.0, 3.0), (1.0, 3.0)]);
    }
}
