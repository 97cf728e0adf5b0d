//! The figures of a flight: the paper's four per controller, the estimates, the Lyapunov function, the
//! path, and for controller 2 the auxiliary system.

use super::Figure;
use super::panel::{Guide, Panel, Style};
use super::record::FigureRecorder;
use super::time_series::{
    AXES, BLUE, GREY, ORANGE, PURPLE, TimeSeries, component, first, ground_track, height,
    lower_bound, path_styles, scalar, upper_bound, vector, vector_legend,
};
use ctrl_core::controller::ControllerConfig;
use glam::Vec3;
use sim::guarantee::bounds::ThrustBounds;
use sim::plant::PlantParameters;
use sim::quantity::table::*;

/// All figures of a flight.
#[must_use]
pub fn figures(
    recorder: &FigureRecorder,
    controller: &ControllerConfig,
    vehicle: &PlantParameters,
) -> Vec<Figure> {
    let mut figures = vec![
        overview(recorder, controller),
        position_error(recorder),
        attitude_error(recorder),
        thrust(recorder, controller),
        torque(recorder, controller),
    ];
    if matches!(controller, ControllerConfig::Saturated(_)) {
        figures.push(auxiliary(recorder));
    }
    figures.push(estimates(recorder, controller, vehicle));
    figures.push(lyapunov(recorder, controller));
    figures.push(path(recorder));
    figures
}

fn figure(
    name: &'static str,
    title: &str,
    legend: Vec<(Style, String)>,
    panels: Vec<(f64, Panel)>,
) -> Figure {
    Figure { name, title: title.to_owned(), legend, panels, height: 250.0 }
}

/// Path, distance, attitude and torque at a glance.
fn overview(recorder: &FigureRecorder, controller: &ControllerConfig) -> Figure {
    let (whole, start) = (&recorder.whole, &recorder.transient);
    let first = first(recorder);
    let tilt = TimeSeries::new("angle  [rad]", &scalar(&TILT_ERROR, Style::solid(PURPLE)));
    let panels = vec![
        (1.0, ground_track(whole, "path from above")),
        (1.0, position_quantity().panel(whole, "position error", false)),
        (1.0, tilt.panel(start, &format!("tilt error, {first}"), false)),
        (1.0, torque_quantity(controller).panel(start, &format!("torque, {first}"), true)),
    ];
    let [flown, wanted] = path_styles();
    let mut legend = vec![(flown, "flown".to_owned()), (wanted, "reference".to_owned())];
    legend.extend(vector_legend(["x", "y", "z"]));
    let title = match controller {
        ControllerConfig::RobustAdaptive(_) => "Controller 1: robust adaptive",
        ControllerConfig::Saturated(_) => "Controller 2: robust adaptive with input saturation",
    };
    figure("overview", title, legend, panels)
}

fn position_quantity() -> TimeSeries {
    TimeSeries::new("p \u{2212} p_{d}  [m]", &vector(&POSITION_ERROR))
}

fn position_error(recorder: &FigureRecorder) -> Figure {
    let legend = vector_legend(["x", "y", "z"]);
    let panels = position_quantity().panels(recorder, false);
    figure("position-error", "Position error", legend, panels)
}

fn attitude_error(recorder: &FigureRecorder) -> Figure {
    let [x, y, z] = vector(&ATTITUDE_ERROR);
    let eta = component(&ATTITUDE_ERROR, 0, Style::solid(PURPLE));
    // Next to eta, small vector parts would not be seen: only the first panel shows it.
    let mut panels = TimeSeries::new("ε_{e}  [-]", &[x, y, z]).panels(recorder, false);
    let all = TimeSeries::new("q_{e}  [-]", &[eta, x, y, z]);
    if let Some((_, panel)) = panels.first_mut() {
        *panel = all.panel(&recorder.whole, "whole flight", false);
    }
    let mut legend = vec![(eta.1, "η_{e}".to_owned())];
    legend.extend(vector_legend(["ε_{e,x}", "ε_{e,y}", "ε_{e,z}"]));
    figure("attitude-error", "Attitude error quaternion", legend, panels)
}

fn thrust(recorder: &FigureRecorder, controller: &ControllerConfig) -> Figure {
    let mut guides = vec![
        lower_bound(controller.thrust_lower_bound(), "lower bound (19)"),
        upper_bound(controller.thrust_upper_bound(), "upper bound (20)"),
    ];
    guides.extend(controller.thrust_max().map(f64::from).map(|limit| lower_bound(limit, "M_{f}")));
    let style = Style::solid(BLUE);
    let quantity = TimeSeries::new("f  [N]", &scalar(&THRUST, style)).with_guides(guides);
    let legend = vec![(style, "f".to_owned())];
    figure("thrust", "Thrust", legend, quantity.panels(recorder, true))
}

/// The bounds of the three axes that differ, with what is added to their names.
fn per_axis(bounds: Vec3) -> Vec<(f64, &'static str)> {
    let [x, y, z] = bounds.as_dvec3().to_array();
    if x == y && x == z {
        vec![(x, "")]
    } else if x == y {
        vec![(x, ",xy"), (z, ",z")]
    } else {
        vec![(x, ",x"), (y, ",y"), (z, ",z")]
    }
}

fn torque_quantity(controller: &ControllerConfig) -> TimeSeries {
    // Three dense lines on top of each other: let those below shine through.
    let translucent = |(channel, style)| (channel, Style { width: 1.0, opacity: 0.75, ..style });
    let bounds = |(limit, axis): (f64, &str)| {
        let name = format!("M_{{τ{axis}}}");
        [upper_bound(limit, &name), lower_bound(-limit, &format!("\u{2212}{name}"))]
    };
    let limits = controller.torque_max().map(per_axis).into_iter().flatten();
    TimeSeries::new("τ  [N m]", &vector(&TORQUE).map(translucent))
        .with_guides(limits.flat_map(bounds))
}

fn torque(recorder: &FigureRecorder, controller: &ControllerConfig) -> Figure {
    let legend = vector_legend(["τ_{x}", "τ_{y}", "τ_{z}"]);
    figure("torque", "Torque", legend, torque_quantity(controller).panels(recorder, true))
}

fn auxiliary(recorder: &FigureRecorder) -> Figure {
    let demand = TimeSeries::new("τ_{d}  [N m]", &vector(&TORQUE_DEMAND));
    let rate = TimeSeries::new("w_{a}  [rad/s]", &vector(&AUXILIARY_RATE));
    let angle_style = Style::solid(PURPLE);
    let angle = TimeSeries::new("angle of q_{a}  [rad]", &scalar(&AUXILIARY_ANGLE, angle_style));
    let mut legend = vector_legend(["x", "y", "z"]);
    legend.push((angle_style, "angle of q_{a}".to_owned()));
    let (start, first) = (&recorder.transient, first(recorder));
    let panels = vec![
        (1.0, demand.panel(start, &format!("torque demand, {first}"), false)),
        (1.0, rate.panel(start, &format!("auxiliary rate, {first}"), false)),
        (1.0, angle.panel(&recorder.whole, "auxiliary attitude, whole flight", false)),
    ];
    figure("auxiliary", "Torque demand before saturation, and auxiliary system", legend, panels)
}

fn estimates(
    recorder: &FigureRecorder,
    controller: &ControllerConfig,
    vehicle: &PlantParameters,
) -> Figure {
    let known = controller.uncertainty();
    let truth = |value, label: &str, colour| Guide { colour, ..lower_bound(value, label) };
    let mass_style = Style::solid(PURPLE);
    let mass = TimeSeries::new("mass  [kg]", &scalar(&MASS_ESTIMATE, mass_style)).with_guides([
        truth(vehicle.mass, "true mass", GREY),
        lower_bound(known.mass.lower.into(), "m_{lo}"),
        upper_bound(known.mass.upper.into(), "m_{hi}"),
    ]);
    let lower = per_axis(known.inertia.lower).into_iter();
    let upper = per_axis(known.inertia.upper).into_iter();
    let mut guides: Vec<_> = lower
        .map(|(value, axis)| lower_bound(value, &format!("J_{{lo{axis}}}")))
        .chain(upper.map(|(value, axis)| upper_bound(value, &format!("J_{{hi{axis}}}"))))
        .collect();
    let names = ["true J_{x}", "true J_{y}", "true J_{z}"];
    for ((value, label), colour) in vehicle.inertia.to_array().into_iter().zip(names).zip(AXES) {
        if guides.iter().all(|guide| guide.value != value) {
            guides.push(truth(value, label, colour));
        }
    }
    let inertia =
        TimeSeries::new("inertia  [kg m²]", &vector(&INERTIA_ESTIMATE)).with_guides(guides);
    let mut legend = vec![(mass_style, "mass".to_owned())];
    legend.extend(vector_legend(["J_{x}", "J_{y}", "J_{z}"]));
    let panels = vec![
        (0.8, mass.panel(&recorder.transient, &first(recorder), true)),
        (1.0, mass.panel(&recorder.whole, "whole flight", true)),
        (0.8, inertia.panel(&recorder.transient, &first(recorder), true)),
        (1.0, inertia.panel(&recorder.whole, "whole flight", true)),
    ];
    let title = "Estimates of mass and inertia; dashed: true values and the borders of their sets";
    figure("estimates", title, legend, panels)
}

fn lyapunov(recorder: &FigureRecorder, controller: &ControllerConfig) -> Figure {
    let name = match controller {
        ControllerConfig::RobustAdaptive(_) => "V_{3}",
        ControllerConfig::Saturated(_) => "V_{5}",
    };
    let (style, state_style) = (Style::solid(BLUE), Style::solid(ORANGE));
    let change_label = format!("{name} \u{2212} {name}(0)  [-]");
    let total = TimeSeries::new(&change_label, &scalar(&LYAPUNOV, style));
    let state_label = format!("{name} without parameter terms  [-]");
    let state = TimeSeries::new(&state_label, &scalar(&LYAPUNOV_STATE, state_style));
    let panels = vec![
        (1.0, total.panel(&recorder.transient, &first(recorder), false)),
        (1.0, state.decades(&recorder.transient, &first(recorder))),
        (1.0, state.decades(&recorder.whole, "whole flight")),
    ];
    let legend = vec![
        (style, format!("{name}, all terms, since the start")),
        (state_style, format!("{name} without the terms of the parameter errors")),
    ];
    figure("lyapunov", "Lyapunov function from the plant's truth", legend, panels)
}

fn path(recorder: &FigureRecorder) -> Figure {
    let mut panels = vec![
        (1.0, ground_track(&recorder.whole, "from above, whole flight")),
        (1.0, height().panel(&recorder.whole, "height, whole flight", false)),
    ];
    if recorder.transient.end < recorder.whole.end {
        let title = format!("from above, {}", first(recorder));
        panels.insert(1, (1.0, ground_track(&recorder.transient, &title)));
    }
    let [flown, wanted] = path_styles();
    let legend = vec![(flown, "flown".to_owned()), (wanted, "reference".to_owned())];
    Figure { height: 330.0, ..figure("path", "Path", legend, panels) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::scenario::LoadedScenario;

    fn documents(name: &str, duration: f64) -> Vec<(&'static str, String)> {
        let loaded = LoadedScenario::open(name, &[format!("duration={duration:?}")]).unwrap();
        let scenario = loaded.scenario();
        let vehicle = scenario.vehicle.into();
        let mut recorder = FigureRecorder::new(duration, 0.6 * duration);
        loaded.flight().unwrap().observe(scenario.ticks(), &mut recorder);
        let figures = figures(&recorder, &scenario.controller, &vehicle);
        figures.iter().map(|figure| (figure.name, figure.svg(name))).collect()
    }

    #[test]
    fn every_figure_is_well_formed_finite_and_labelled() {
        for (name, count) in [("paper-robust-adaptive", 8), ("paper-saturated", 9)] {
            for duration in [2.0, 25.0] {
                let documents = documents(name, duration);
                assert_eq!(documents.len(), count);
                for (figure, svg) in documents {
                    for (open, close) in [("<text", "</text>"), ("<g ", "</g>"), ("<svg", "</svg>")]
                    {
                        let (opened, closed) = (svg.matches(open), svg.matches(close));
                        assert_eq!(opened.count(), closed.count(), "{figure}: {open}");
                    }
                    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{figure} of {name}");
                    assert!(svg.contains("<path d=\"M"), "{figure} of {name} shows nothing");
                    assert!(svg.contains("[s]") || svg.contains("[m]"), "{figure} has no unit");
                }
            }
        }
    }

    #[test]
    fn limits_are_drawn_where_there_are_any() {
        let svg = |name, figure: &str| {
            documents(name, 1.0).into_iter().find(|(name, _)| *name == figure).unwrap().1
        };
        assert!(svg("paper-saturated", "torque").contains("stroke-dasharray"));
        assert!(!svg("paper-robust-adaptive", "torque").contains("stroke-dasharray"));
        assert!(svg("paper-robust-adaptive", "thrust").contains("lower bound (19)"));
    }
}
