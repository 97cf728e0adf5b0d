//! Quantities over time, and the panels that show them over the windows of a flight.

use super::axis::Axis;
use super::panel::{Guide, Line, Panel, Style};
use super::record::{FigureRecorder, FigureWindow, channel};
use sim::quantity::Quantity;
use sim::quantity::table::{POSITION, REFERENCE_POSITION};

pub(super) const BLUE: &str = "#0072B2";
pub(super) const ORANGE: &str = "#D55E00";
pub(super) const GREEN: &str = "#009E73";
pub(super) const PURPLE: &str = "#AA4499";
pub(super) const GREY: &str = "#888888";
/// Bounds.
pub(super) const RED: &str = "#C1121F";

/// Colours of x, y and z.
pub(super) const AXES: [&str; 3] = [BLUE, ORANGE, GREEN];

/// Channels over time on one axis.
pub(super) struct TimeSeries {
    label: String,
    channels: Vec<(usize, Style)>,
    guides: Vec<Guide>,
}

impl TimeSeries {
    pub fn new(label: &str, channels: &[(usize, Style)]) -> Self {
        Self { label: label.to_owned(), channels: channels.to_vec(), guides: Vec::new() }
    }

    pub fn with_guides(self, guides: impl IntoIterator<Item = Guide>) -> Self {
        Self { guides: guides.into_iter().collect(), ..self }
    }

    /// Over one window. With `bounded`, the axis reaches to every guide.
    pub fn panel(&self, window: &FigureWindow, title: &str, bounded: bool) -> Panel {
        let line = |(channel, style): &(usize, Style)| Line {
            points: window.line(*channel).collect(),
            style: *style,
        };
        let lines: Vec<Line> = self.channels.iter().map(line).collect();
        let guides = self.guides.iter().filter(|_| bounded).map(|guide| guide.value);
        let values = lines.iter().flat_map(|line| line.points.iter().map(|(_, y)| *y));
        Panel {
            title: title.to_owned(),
            x: Axis::exact("time [s]", window.start, window.end),
            y: Axis::around(&self.label, values.chain(guides)),
            lines,
            guides: self.guides.clone(),
            marks: Vec::new(),
            equal: false,
        }
    }

    /// Over one window, by decades.
    pub fn decades(&self, window: &FigureWindow, title: &str) -> Panel {
        let panel = self.panel(window, title, false);
        let values = panel.lines.iter().flat_map(|line| line.points.iter().map(|(_, y)| *y));
        let y = Axis::decades(&self.label, values);
        Panel { y, ..panel }
    }

    /// The whole flight, its start, and what follows the settling time.
    pub fn panels(&self, recorder: &FigureRecorder, bounded: bool) -> Vec<(f64, Panel)> {
        let mut panels = vec![(1.5, self.panel(&recorder.whole, "whole flight", bounded))];
        if recorder.transient.end < recorder.whole.end {
            panels.push((1.0, self.panel(&recorder.transient, &first(recorder), bounded)));
        }
        if let Some(settled) = &recorder.settled {
            panels.push((0.85, self.panel(settled, "after settling", false)));
        }
        panels
    }
}

/// Title of the enlarged start of the flight.
pub(super) fn first(recorder: &FigureRecorder) -> String {
    format!("first {} s", recorder.transient.end)
}

/// Channel of a component of a recorded quantity, in `style`.
///
/// # Panics
/// If the recorder does not record the quantity.
pub(super) fn component(quantity: &Quantity, component: usize, style: Style) -> (usize, Style) {
    let first = channel(quantity);
    let first = first.unwrap_or_else(|| panic!("`{}` is not recorded for figures", quantity.name));
    (first + component, style)
}

/// Channel of a recorded scalar, in `style`.
pub(super) fn scalar(quantity: &Quantity, style: Style) -> [(usize, Style); 1] {
    [component(quantity, 0, style)]
}

/// The last three channels of a recorded vector or quaternion, in the colours of the axes.
pub(super) fn vector(quantity: &Quantity) -> [(usize, Style); 3] {
    let first = quantity.width() - 3;
    [0, 1, 2].map(|axis| component(quantity, first + axis, Style::solid(AXES[axis])))
}

pub(super) fn vector_legend(names: [&str; 3]) -> Vec<(Style, String)> {
    AXES.into_iter().zip(names).map(|(c, name)| (Style::solid(c), name.to_owned())).collect()
}

/// A lower bound, named above its line.
pub(super) fn lower_bound(value: f64, label: &str) -> Guide {
    Guide { value, label: label.to_owned(), colour: RED, below: false }
}

/// An upper bound, named below its line.
pub(super) fn upper_bound(value: f64, label: &str) -> Guide {
    Guide { below: true, ..lower_bound(value, label) }
}

/// Styles of the flown path and of the reference, a broad pale line below it.
pub(super) fn path_styles() -> [Style; 2] {
    [Style::solid("#222222"), Style { width: 4.0, ..Style::solid("#9BD0F2") }]
}

/// Both ground tracks, to the same scale in both directions.
pub(super) fn ground_track(window: &FigureWindow, title: &str) -> Panel {
    let [flown, wanted] = path_styles();
    let [vehicle, reference] = window.ground_tracks();
    let all = || vehicle.iter().chain(&reference);
    let x = Axis::around("x  [m]", all().map(|(x, _)| *x));
    let y = Axis::around("y  [m]", all().map(|(_, y)| *y));
    let marks = vehicle.first().map(|start| vec![(*start, "start")]).unwrap_or_default();
    let lines =
        vec![Line { points: reference, style: wanted }, Line { points: vehicle, style: flown }];
    Panel { title: title.to_owned(), x, y, lines, guides: Vec::new(), marks, equal: true }
}

/// Height of vehicle and reference.
pub(super) fn height() -> TimeSeries {
    let [flown, wanted] = path_styles();
    TimeSeries::new(
        "z  [m]",
        &[component(&REFERENCE_POSITION, 2, wanted), component(&POSITION, 2, flown)],
    )
}
