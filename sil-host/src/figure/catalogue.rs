//! Which figures a flight gets: the paper's four a controller, the estimates, the Lyapunov
//! function, the path, and for controller 2 the auxiliary system.

use super::Figure;
use super::axis::Axis;
use super::panel::{Guide, Line, Panel, Style};
use super::record::{Recorder, Window, channel};
use crate::plant::PlantParameters;
use crate::scenario::ControllerConfig;

const BLUE: &str = "#0072B2";
const ORANGE: &str = "#D55E00";
const GREEN: &str = "#009E73";
const PURPLE: &str = "#AA4499";
const GREY: &str = "#888888";
const BOUND: &str = "#C1121F";

/// Colours of x, y, z, and of the scalar part.
const AXES: [&str; 3] = [BLUE, ORANGE, GREEN];
const TIME: &str = "time [s]";

/// All figures of a flight.
#[must_use]
pub fn figures(
    recorder: &Recorder,
    controller: &ControllerConfig,
    vehicle: &PlantParameters,
) -> Vec<Figure> {
    let mut figures = vec![
        position_error(recorder),
        attitude_error(recorder),
        thrust(recorder, controller),
        torque(recorder, controller),
        estimates(recorder, controller, vehicle),
        lyapunov(recorder, controller),
        path(recorder),
    ];
    if matches!(controller, ControllerConfig::Saturated(_)) {
        figures.insert(4, auxiliary(recorder));
    }
    figures
}

/// What a panel over time shows.
struct Quantity<'a> {
    label: &'a str,
    channels: &'a [(usize, Style)],
    guides: Vec<Guide>,
}

impl Quantity<'_> {
    /// Over one window. With `bounded`, the axis reaches to every guide.
    fn panel(&self, window: &Window, title: &str, bounded: bool) -> Panel {
        let lines: Vec<Line> = self
            .channels
            .iter()
            .map(|(channel, style)| Line { points: window.line(*channel).collect(), style: *style })
            .collect();
        let guides = self.guides.iter().filter(|_| bounded).map(|guide| guide.value);
        let values =
            lines.iter().flat_map(|line| line.points.iter().map(|(_, y)| *y)).chain(guides);
        Panel {
            title: title.to_owned(),
            x: Axis::exact(TIME, window.start, window.end),
            y: Axis::around(self.label, values),
            lines,
            guides: self.guides.clone(),
            marks: Vec::new(),
        }
    }

    /// The whole flight, its start, and what follows the settling time.
    fn panels(&self, recorder: &Recorder, bounded: bool) -> Vec<(f64, Panel)> {
        let mut panels = vec![(1.5, self.panel(&recorder.whole, "whole flight", bounded))];
        if recorder.transient.end < recorder.whole.end {
            let title = format!("first {} s", recorder.transient.end);
            panels.push((1.0, self.panel(&recorder.transient, &title, bounded)));
        }
        if let Some(settled) = &recorder.settled {
            panels.push((0.85, self.panel(settled, "after settling", false)));
        }
        panels
    }
}

/// Three channels from `first` in the colours of the axes.
fn vector(first: usize) -> [(usize, Style); 3] {
    [0, 1, 2].map(|axis| (first + axis, Style::solid(AXES[axis])))
}

fn vector_legend(names: [&str; 3]) -> Vec<(Style, String)> {
    AXES.into_iter().zip(names).map(|(c, name)| (Style::solid(c), name.to_owned())).collect()
}

fn figure(
    name: &'static str,
    title: &str,
    legend: Vec<(Style, String)>,
    panels: Vec<(f64, Panel)>,
) -> Figure {
    Figure { name, title: title.to_owned(), legend, panels, height: 250.0 }
}

fn guide(value: f64, label: &str) -> Guide {
    Guide { value, label: label.to_owned(), colour: BOUND }
}

fn position_error(recorder: &Recorder) -> Figure {
    let quantity = Quantity {
        label: "p \u{2212} p_{d}  [m]",
        channels: &vector(channel::POSITION_ERROR),
        guides: Vec::new(),
    };
    let legend = vector_legend(["x", "y", "z"]);
    figure("position-error", "Position error", legend, quantity.panels(recorder, false))
}

fn attitude_error(recorder: &Recorder) -> Figure {
    let [x, y, z] = vector(channel::ATTITUDE_ERROR + 1);
    let eta = (channel::ATTITUDE_ERROR, Style::solid(PURPLE));
    let all = Quantity { label: "q_{e}  [-]", channels: &[eta, x, y, z], guides: Vec::new() };
    let mut panels = all.panels(recorder, false);
    if let (Some(settled), Some(last)) = (&recorder.settled, panels.last_mut()) {
        // eta is one to many digits: only the vector part still shows something.
        let vector = Quantity { label: "ε_{e}  [-]", channels: &[x, y, z], guides: Vec::new() };
        last.1 = vector.panel(settled, "after settling", false);
    }
    let mut legend = vec![(eta.1, "η_{e}".to_owned())];
    legend.extend(vector_legend(["ε_{e,x}", "ε_{e,y}", "ε_{e,z}"]));
    figure("attitude-error", "Attitude error quaternion", legend, panels)
}

fn thrust(recorder: &Recorder, controller: &ControllerConfig) -> Figure {
    let mut guides = vec![
        guide(controller.thrust_lower_bound(), "lower bound (19)"),
        guide(controller.thrust_upper_bound(), "upper bound (20)"),
    ];
    guides.extend(controller.thrust_max().map(|limit| guide(limit, "M_{f}")));
    let style = Style::solid(BLUE);
    let quantity = Quantity { label: "f  [N]", channels: &[(channel::THRUST, style)], guides };
    let legend = vec![(style, "f".to_owned())];
    figure("thrust", "Thrust", legend, quantity.panels(recorder, true))
}

fn torque(recorder: &Recorder, controller: &ControllerConfig) -> Figure {
    let bounds = |limit| [guide(limit, "M_{τ}"), guide(-limit, "\u{2212}M_{τ}")];
    let quantity = Quantity {
        label: "τ  [N m]",
        channels: &vector(channel::TORQUE),
        guides: controller.torque_max().map_or_else(Vec::new, |limit| bounds(limit).to_vec()),
    };
    let legend = vector_legend(["τ_{x}", "τ_{y}", "τ_{z}"]);
    figure("torque", "Torque", legend, quantity.panels(recorder, true))
}

fn auxiliary(recorder: &Recorder) -> Figure {
    let demand = Quantity {
        label: "τ_{d}  [N m]",
        channels: &vector(channel::TORQUE_DEMAND),
        guides: Vec::new(),
    };
    let angle_style = Style::solid(PURPLE);
    let rate = Quantity {
        label: "w_{a}  [rad/s]",
        channels: &vector(channel::AUXILIARY_RATE),
        guides: Vec::new(),
    };
    let angle = Quantity {
        label: "angle of q_{a}  [rad]",
        channels: &[(channel::AUXILIARY_ANGLE, angle_style)],
        guides: Vec::new(),
    };
    let mut legend = vector_legend(["x", "y", "z"]);
    legend.push((angle_style, "angle of q_{a}".to_owned()));
    let start = format!("first {} s", recorder.transient.end);
    let panels = vec![
        (1.0, demand.panel(&recorder.transient, &format!("torque demand, {start}"), false)),
        (1.0, rate.panel(&recorder.transient, &format!("auxiliary rate, {start}"), false)),
        (1.0, angle.panel(&recorder.whole, "auxiliary attitude, whole flight", false)),
    ];
    figure("auxiliary", "Torque demand before saturation, and auxiliary system", legend, panels)
}

fn estimates(
    recorder: &Recorder,
    controller: &ControllerConfig,
    vehicle: &PlantParameters,
) -> Figure {
    let truth = |value, label: &str, colour| Guide { value, label: label.to_owned(), colour };
    let uncertainty = controller.uncertainty();
    let mass_style = Style::solid(PURPLE);
    let mass = Quantity {
        label: "mass  [kg]",
        channels: &[(channel::MASS, mass_style)],
        guides: vec![
            truth(vehicle.mass, "true mass", GREY),
            guide(uncertainty.mass.lower.into(), "m_{lo}"),
            guide(uncertainty.mass.upper.into(), "m_{hi}"),
        ],
    };
    let inertia = Quantity {
        label: "inertia  [kg m²]",
        channels: &vector(channel::INERTIA),
        guides: vec![
            truth(vehicle.inertia.x, "true J_{x}", BLUE),
            truth(vehicle.inertia.y, "", ORANGE),
            truth(vehicle.inertia.z, "true J_{z}", GREEN),
            guide(uncertainty.inertia.lower.into(), "J_{lo}"),
            guide(uncertainty.inertia.upper.into(), "J_{hi}"),
        ],
    };
    let mut legend = vec![(mass_style, "mass".to_owned())];
    legend.extend(vector_legend(["J_{x}", "J_{y}", "J_{z}"]));
    let panels = vec![
        (1.0, mass.panel(&recorder.whole, "mass estimate, whole flight", true)),
        (1.0, inertia.panel(&recorder.whole, "inertia estimate, whole flight", true)),
    ];
    figure(
        "estimates",
        "Estimates; dashed: true values and the borders of their sets",
        legend,
        panels,
    )
}

fn lyapunov(recorder: &Recorder, controller: &ControllerConfig) -> Figure {
    let name = match controller {
        ControllerConfig::RobustAdaptive(_) => "V_{3}",
        ControllerConfig::Saturated(_) => "V_{5}",
    };
    let style = Style::solid(BLUE);
    let state_style = Style::solid(ORANGE);
    let total = Quantity {
        label: &format!("{name}  [-]"),
        channels: &[(channel::LYAPUNOV, style)],
        guides: Vec::new(),
    };
    let state = Quantity {
        label: &format!("{name} without parameter terms  [-]"),
        channels: &[(channel::LYAPUNOV_STATE, state_style)],
        guides: Vec::new(),
    };
    let decades = |window: &Window, title: &str| {
        let mut panel = state.panel(window, title, false);
        panel.y =
            Axis::decades(&panel.y.label, window.line(channel::LYAPUNOV_STATE).map(|(_, y)| y));
        panel
    };
    let start = format!("first {} s", recorder.transient.end);
    let panels = vec![
        (1.0, total.panel(&recorder.transient, &start, false)),
        (1.0, decades(&recorder.transient, &start)),
        (1.0, decades(&recorder.whole, "whole flight")),
    ];
    let legend = vec![
        (style, format!("{name}, all terms")),
        (state_style, format!("{name} without the terms of the parameter errors")),
    ];
    figure("lyapunov", "Lyapunov function from the plant's truth", legend, panels)
}

fn path(recorder: &Recorder) -> Figure {
    let (flown, wanted) = (Style::solid(BLUE), Style { width: 1.6, ..Style::dashed(ORANGE) });
    let height = Quantity {
        label: "z  [m]",
        channels: &[(channel::HEIGHT + 1, wanted), (channel::HEIGHT, flown)],
        guides: Vec::new(),
    };
    let axes_height = 330.0;
    let mut panels = vec![
        (1.0, ground_track(&recorder.whole, "from above, whole flight", [wanted, flown])),
        (1.0, height.panel(&recorder.whole, "height, whole flight", false)),
    ];
    if recorder.transient.end < recorder.whole.end {
        let title = format!("from above, first {} s", recorder.transient.end);
        panels.insert(1, (1.0, ground_track(&recorder.transient, &title, [wanted, flown])));
    }
    let legend = vec![(flown, "flown".to_owned()), (wanted, "reference".to_owned())];
    Figure { height: axes_height, ..figure("path", "Path", legend, panels) }
}

/// Both ways over the ground, to the same scale in both directions.
fn ground_track(window: &Window, title: &str, [wanted, flown]: [Style; 2]) -> Panel {
    let [vehicle, reference] = window.ground_tracks();
    let all = || vehicle.iter().chain(&reference);
    let mut x = Axis::around("x  [m]", all().map(|(x, _)| *x));
    let mut y = Axis::around("y  [m]", all().map(|(_, y)| *y));
    let reach = (x.upper - x.lower).max(y.upper - y.lower);
    for axis in [&mut x, &mut y] {
        let missing = reach - (axis.upper - axis.lower);
        (axis.lower, axis.upper) = (axis.lower - 0.5 * missing, axis.upper + 0.5 * missing);
    }
    let marks = vehicle.first().map(|start| vec![(*start, "start")]).unwrap_or_default();
    Panel {
        title: title.to_owned(),
        x,
        y,
        lines: vec![
            Line { points: reference, style: wanted },
            Line { points: vehicle, style: flown },
        ],
        guides: Vec::new(),
        marks,
    }
}
