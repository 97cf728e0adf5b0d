//! Poles over the corners of the uncertainty: the slowest, the least damped, the sampled ones.

use serde::Serialize;

use super::hover::{Corner, Hover, Loop};
use super::pole::Pole;
use ctrl_core::controller::ControllerConfig;

/// Slopes of a smooth sign as shares of its slope at zero: large signals, middling ones, small ones.
const SLOPES: [f64; 3] = [0.0, 0.3, 1.0];

/// Body axis of the heading.
const HEADING_AXIS: usize = 2;

const ALL_AXES: [usize; 3] = [0, 1, HEADING_AXIS];

/// The loops at hover.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Which {
    /// Position and tilt along a horizontal axis.
    Lateral,
    /// Height at a constant mass estimate.
    Vertical,
    /// Height while the mass adapts: integral action.
    VerticalAdaptive,
    /// Attitude about one axis: a tilt axis, or any while they are alike.
    Attitude,
    /// Attitude about the vertical body axis, where it is unlike the others.
    Heading,
    /// Position and tilt with the estimates of integral action.
    LateralIntegral,
    /// Attitude with the estimate of the lasting torque.
    AttitudeIntegral,
    /// Heading with the estimate of the lasting torque.
    HeadingIntegral,
}

impl Which {
    /// Those of `law`: with the heading by itself where it is unlike the tilt axes.
    #[must_use]
    pub fn of(law: &ControllerConfig) -> Vec<Self> {
        let mut all = vec![Self::Lateral, Self::Vertical, Self::VerticalAdaptive, Self::Attitude];
        let hover = Hover::new(law);
        let heading = hover.distinct(&ALL_AXES).contains(&HEADING_AXIS);
        let [force, torque] = hover.lasting.map(|gain| gain > 0.0);
        for (which, there) in [
            (Self::Heading, heading),
            (Self::LateralIntegral, force || torque),
            (Self::AttitudeIntegral, torque),
            (Self::HeadingIntegral, torque && heading),
        ] {
            all.extend(there.then_some(which));
        }
        all
    }

    /// `true` for a loop with an estimate that learns, whose slow mode is shown and not asked for.
    #[must_use]
    pub fn learns(self) -> bool {
        self == Self::VerticalAdaptive || self.is_integral()
    }

    /// `true` for a loop with estimates of integral action.
    #[must_use]
    pub fn is_integral(self) -> bool {
        matches!(self, Self::LateralIntegral | Self::AttitudeIntegral | Self::HeadingIntegral)
    }

    /// Body axes that it is about; the vertical one has none and stands for itself.
    #[must_use]
    pub fn axes(self) -> &'static [usize] {
        match self {
            Self::Lateral | Self::Attitude | Self::LateralIntegral | Self::AttitudeIntegral => {
                &[0, 1]
            }
            Self::Vertical | Self::VerticalAdaptive => &[0],
            Self::Heading | Self::HeadingIntegral => &[HEADING_AXIS],
        }
    }

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Lateral => "position and tilt",
            Self::Vertical => "height",
            Self::VerticalAdaptive => "height, mass adapting",
            Self::Attitude => "attitude",
            Self::Heading => "heading",
            Self::LateralIntegral => "position, integral",
            Self::AttitudeIntegral => "attitude, integral",
            Self::HeadingIntegral => "heading, integral",
        }
    }

    /// The loop at `corner`.
    #[must_use]
    pub fn at(self, hover: &Hover, corner: &Corner) -> Loop {
        match self {
            Self::Lateral => hover.lateral(corner, false),
            Self::Vertical => hover.vertical(corner, false),
            Self::VerticalAdaptive => hover.vertical(corner, true),
            Self::Attitude | Self::Heading => hover.attitude(corner, false),
            Self::LateralIntegral => hover.lateral(corner, true),
            Self::AttitudeIntegral | Self::HeadingIntegral => hover.attitude(corner, true),
        }
    }
}

/// A number, the corner at which it is met, and the pole that has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// The number.
    pub value: f64,
    /// Corner at which it is met.
    pub corner: Corner,
    /// By which pole, as `ln(z)/dt`.
    pub pole: Pole,
}

/// Poles of one loop over the corners.
#[derive(Clone, Debug)]
pub struct LoopSurvey {
    /// Loop.
    pub which: Which,
    /// Poles at the nominal vehicle in continuous time, slowest first.
    pub nominal: Vec<Pole>,
    /// The same of the sampled loop, as `ln(z)/dt`.
    pub nominal_sampled: Vec<Pole>,
    /// Least modulus of a sampled pole (rad/s).
    pub bandwidth: Met,
    /// Least damping ratio of a sampled pole.
    pub damping: Met,
    /// Slowest decay of a sampled mode (1/s).
    pub decay: Met,
    /// Largest modulus of a sampled pole, `|z|`.
    pub sampled_modulus: f64,
}

/// Corner that the gains are designed for about `axis`: the initial estimates are right, signals are small.
#[must_use]
pub fn nominal(law: &ControllerConfig, axis: usize) -> Corner {
    let initial = law.initial();
    Corner {
        axis,
        mass: initial.mass.into(),
        inertia: initial.inertia[axis].into(),
        inertia_estimate: initial.inertia[axis].into(),
        translation_slope: 1.0,
        rotation_slope: 1.0,
    }
}

/// Every combination of what the loop `which` depends on: its axes that are unlike, ends and middle of the
/// mass, of the inertia and of its estimate, and slopes of the smooth signs. The rest is as in `nominal`.
#[must_use]
pub fn corners(which: Which, hover: &Hover, nominal: &Corner) -> Vec<Corner> {
    let axes = hover.distinct(which.axes()).into_iter();
    axes.flat_map(|axis| corners_about(which, hover, &Corner { axis, ..*nominal })).collect()
}

fn corners_about(which: Which, hover: &Hover, nominal: &Corner) -> Vec<Corner> {
    let ends = |interval: ctrl_core::vehicle::Interval| {
        let (lower, upper) = (f64::from(interval.lower), f64::from(interval.upper));
        vec![lower, (lower * upper).sqrt(), upper]
    };
    let (mut masses, mut inertias) = (vec![nominal.mass], vec![nominal.inertia]);
    let (mut translation, mut rotation) = (vec![1.0], vec![1.0]);
    if matches!(which, Which::Vertical | Which::VerticalAdaptive) {
        masses = ends(hover.known.mass);
    } else {
        inertias = ends(hover.known.inertia.axes()[nominal.axis]);
        rotation = SLOPES.to_vec();
    }
    if !matches!(
        which,
        Which::Attitude | Which::Heading | Which::AttitudeIntegral | Which::HeadingIntegral
    ) {
        translation = SLOPES.to_vec();
    }
    let mut corners = Vec::new();
    for &mass in &masses {
        for &inertia in &inertias {
            for &inertia_estimate in &inertias {
                for &translation_slope in &translation {
                    corners.extend(rotation.iter().map(|&rotation_slope| Corner {
                        axis: nominal.axis,
                        mass,
                        inertia,
                        inertia_estimate,
                        translation_slope,
                        rotation_slope,
                    }));
                }
            }
        }
    }
    corners
}

impl LoopSurvey {
    /// Of the loop `which` of `law`.
    #[must_use]
    pub fn new(which: Which, law: &ControllerConfig) -> Self {
        let hover = Hover::new(law);
        let nominal = nominal(law, which.axes()[0]);
        let here = which.at(&hover, &nominal);
        let pole = Pole { re: f64::NEG_INFINITY, im: 0.0 };
        let none = Met { value: f64::INFINITY, corner: nominal, pole };
        let mut survey = Self {
            which,
            nominal: here.continuous_poles(),
            nominal_sampled: here.sampled_poles(),
            bandwidth: none,
            damping: none,
            decay: none,
            sampled_modulus: 0.0,
        };
        for corner in corners(which, &hover, &nominal) {
            survey.take_in(&which.at(&hover, &corner).sampled_poles(), corner, hover.dt);
        }
        survey
    }

    fn take_in(&mut self, poles: &[Pole], corner: Corner, dt: f64) {
        let lower = |kept: &mut Met, value: f64, pole: Pole| {
            if value.is_nan() || value < kept.value {
                *kept = Met { value, corner, pole };
            }
        };
        for &pole in poles {
            lower(&mut self.bandwidth, pole.modulus(), pole);
            lower(&mut self.damping, pole.damping(), pole);
            lower(&mut self.decay, -pole.re, pole);
            self.sampled_modulus = self.sampled_modulus.max(pole.sampled_modulus(dt));
        }
    }
}
