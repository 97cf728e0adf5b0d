//! Data of the figures, reduced while the flight goes on: least and greatest value of every channel in
//! each pixel column, so that no peak is lost and memory does not grow with the flight.

use glam::DVec2;

use sim::observer::Observer;
use sim::quantity::Quantity;
use sim::quantity::table::*;
use sim::tick::Tick;

/// The recorded quantities, in the order of their channels; each component is a channel.
const QUANTITIES: [&Quantity; 14] = [
    &POSITION_ERROR,
    &ATTITUDE_ERROR,
    &THRUST,
    &TORQUE,
    &TORQUE_DEMAND,
    &MASS_ESTIMATE,
    &INERTIA_ESTIMATE,
    &AUXILIARY_RATE,
    &AUXILIARY_ANGLE,
    &LYAPUNOV,
    &LYAPUNOV_STATE,
    &TILT_ERROR,
    &POSITION,
    &REFERENCE_POSITION,
];

/// Number of channels.
const CHANNELS: usize = {
    let (mut count, mut index) = (0, 0);
    while index < QUANTITIES.len() {
        count += QUANTITIES[index].width();
        index += 1;
    }
    count
};

/// The first channel of `quantity`, or none if it is not recorded.
#[must_use]
pub fn channel(quantity: &Quantity) -> Option<usize> {
    let before = QUANTITIES.iter().position(|it| it.name == quantity.name)?;
    Some(QUANTITIES[..before].iter().map(|it| it.width()).sum())
}

/// One interval of the flight, cut into columns.
#[derive(Clone, Debug)]
pub struct FigureWindow {
    /// Its start (s).
    pub start: f64,
    /// Its end (s).
    pub end: f64,
    columns: Vec<Column>,
}

/// Least and greatest value of every channel, and the last horizontal positions.
#[derive(Clone, Copy, Debug)]
struct Column {
    least: [f32; CHANNELS],
    greatest: [f32; CHANNELS],
    vehicle: DVec2,
    reference: DVec2,
}

impl FigureWindow {
    fn new(start: f64, end: f64, columns: usize) -> Self {
        let empty = Column {
            least: [f32::INFINITY; CHANNELS],
            greatest: [f32::NEG_INFINITY; CHANNELS],
            vehicle: DVec2::NAN,
            reference: DVec2::NAN,
        };
        Self { start, end, columns: vec![empty; columns] }
    }

    fn push(&mut self, tick: &Tick, values: &[f32; CHANNELS]) {
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

    /// Ground tracks of the vehicle and of the reference (m).
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
pub struct FigureRecorder {
    /// The whole flight.
    pub whole: FigureWindow,
    /// Its first seconds.
    pub transient: FigureWindow,
    /// The flight after the settling time, if any is left.
    pub settled: Option<FigureWindow>,
    /// V at the first tick.
    first_lyapunov: Option<f64>,
}

/// Length of the enlarged start of the flight (s).
pub const TRANSIENT: f64 = 20.0;

impl FigureRecorder {
    /// For a flight of `duration` that settles within `settle_time` (s).
    #[must_use]
    pub fn new(duration: f64, settle_time: f64) -> Self {
        let duration = duration.max(f64::MIN_POSITIVE);
        let settled = settle_time < duration;
        Self {
            whole: FigureWindow::new(0.0, duration, 480),
            transient: FigureWindow::new(0.0, duration.min(TRANSIENT), 320),
            settled: settled.then(|| FigureWindow::new(settle_time, duration, 280)),
            first_lyapunov: None,
        }
    }
}

impl Observer for FigureRecorder {
    fn observe(&mut self, tick: &Tick) {
        let first = *self.first_lyapunov.get_or_insert(tick.evaluation.value);
        let values = values(tick, first);
        self.whole.push(tick, &values);
        self.transient.push(tick, &values);
        if let Some(settled) = &mut self.settled {
            settled.push(tick, &values);
        }
    }
}

/// The value of every channel; that of V is less `first_lyapunov`.
fn values(tick: &Tick, first_lyapunov: f64) -> [f32; CHANNELS] {
    let mut values = [0.0; CHANNELS];
    let mut channels = values.iter_mut();
    for quantity in QUANTITIES {
        let origin = if quantity.name == LYAPUNOV.name { first_lyapunov } else { 0.0 };
        quantity.components(tick, |component| {
            if let Some(channel) = channels.next() {
                *channel = (component - origin) as f32;
            }
        });
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window_of(values: impl Iterator<Item = (f64, f32)>) -> FigureWindow {
        let mut window = FigureWindow::new(0.0, 10.0, 5);
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
