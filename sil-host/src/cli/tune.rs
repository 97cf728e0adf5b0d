//! `tune`.

use std::path::PathBuf;

use clap::Args;
use sil_host::tune::check::{Check, check};
use sil_host::tune::request::WantedOptions;
use sil_host::tune::{TuneError, propose, report};

/// Arguments of `tune`.
#[derive(Clone, Debug, Args)]
pub struct TuneArguments {
    /// Vehicle file (docs/tune.md shows one), or a scenario, built-in or file, whose vehicle, limits and
    /// uncertainty are taken and whose gains are not.
    #[arg(value_name = "FILE|NAME")]
    pub vehicle: String,
    /// Least modulus of the poles of position and height (rad/s); 0.5 by default.
    #[arg(long, value_name = "RAD/S")]
    pub position_bandwidth: Option<f64>,
    /// Least modulus of the poles of the attitude about a tilt axis (rad/s); five times the position's by default, less
    /// where the torque does not allow it.
    #[arg(long, value_name = "RAD/S")]
    pub attitude_bandwidth: Option<f64>,
    /// The same about the vertical body axis (rad/s); the attitude's by default, less where there is
    /// less torque for the inertia.
    #[arg(long, value_name = "RAD/S")]
    pub heading_bandwidth: Option<f64>,
    /// Least damping ratio of all; 0.5 by default.
    #[arg(long, value_name = "RATIO")]
    pub damping: Option<f64>,
    /// Share of every inequality's headroom that is kept as margin [default: 0.1].
    #[arg(long, value_name = "SHARE")]
    pub margin: Option<f64>,
    /// Position error up to which the position loop is about linear (m); 0.2 by default.
    #[arg(long, value_name = "M")]
    pub position_range: Option<f64>,
    /// Attitude error up to which the torque suffices for the bandwidth (rad); 0.15 by default.
    #[arg(long, value_name = "RAD")]
    pub attitude_range: Option<f64>,
    /// Least phase margin behind rotors that lag or delay (deg); 30 by default.
    #[arg(long, value_name = "DEG")]
    pub phase_margin: Option<f64>,
    /// White noise of each component of the measured body rate at every tick, standard deviation (rad/s): predicts the
    /// torque that it makes, and checks it in flight; 0 by default, or the vehicle file's or scenario's.
    #[arg(long, value_name = "RAD/S")]
    pub rate_noise: Option<f64>,
    /// Most torque, root mean square over all axes, that this noise may make (N m); any by default.
    #[arg(long, value_name = "N M")]
    pub noise_torque_max: Option<f64>,
    /// Slope of the rotational smooth sign at zero as a multiple of k4; the steepest that step period and noise allow by default.
    #[arg(long, value_name = "RATIO")]
    pub rotation_slope: Option<f64>,
    /// Least speed of return from far away on any axis (m/s); any by default.
    #[arg(long, value_name = "M/S")]
    pub return_speed: Option<f64>,
    /// Model of the rotors inside the law, whose lead leaves so many times less of their lag; 1 for the model alone. Needs
    /// a rotor lag; none by default, or the scenario's.
    #[arg(long, value_name = "RATIO")]
    pub rotor_lead: Option<f64>,
    /// Push along each horizontal axis that lasts, on top of the disturbance acceleration (m/s^2): proposes integral action;
    /// 0 by default, or the vehicle file's or scenario's.
    #[arg(long, value_name = "M/S^2")]
    pub steady_acceleration: Option<f64>,
    /// Torque about each axis that lasts, on top of the disturbance torque (N m): the same.
    #[arg(long, value_name = "N M")]
    pub steady_torque: Option<f64>,
    /// Write a complete scenario with the gains, ready for `run`.
    #[arg(long, value_name = "FILE")]
    pub write: Option<PathBuf>,
    /// Do not fly the check.
    #[arg(long)]
    pub no_check: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print JSON instead of tables.
    #[arg(long)]
    pub json: bool,
}

impl TuneArguments {
    /// Requested closed loop.
    #[must_use]
    pub fn wanted(&self) -> WantedOptions {
        WantedOptions {
            position_bandwidth: self.position_bandwidth,
            attitude_bandwidth: self.attitude_bandwidth,
            heading_bandwidth: self.heading_bandwidth,
            damping: self.damping,
            margin: self.margin,
            position_range: self.position_range,
            attitude_range: self.attitude_range,
            phase_margin_deg: self.phase_margin,
            rotation_slope: self.rotation_slope,
            noise_torque_max: self.noise_torque_max,
            rate_noise: self.rate_noise,
            return_speed: self.return_speed,
            rotor_lead: self.rotor_lead,
            steady_acceleration: self.steady_acceleration,
            steady_torque: self.steady_torque,
        }
    }
}

/// Proposes gains, checks them, prints and writes them; `true` if every check flight held.
///
/// # Errors
/// See [`TuneError`].
pub fn tune(arguments: &TuneArguments) -> Result<bool, TuneError> {
    let proposal = propose(&arguments.vehicle, arguments.wanted())?;
    if let Some(path) = &arguments.write {
        std::fs::write(path, proposal.scenario())
            .map_err(|error| TuneError::Output(path.clone(), error.to_string()))?;
    }
    if !arguments.no_check && !arguments.quiet {
        eprintln!("{}: flying the check", proposal.request.name);
    }
    let checked =
        if arguments.no_check { None } else { Some(check(&proposal).map_err(TuneError::Check)?) };
    let passed = checked.as_ref().is_none_or(Check::passed);
    if arguments.json {
        println!("{}", report::json(&proposal, checked.as_ref(), passed));
    } else if !arguments.quiet {
        print!("{}", report::table(&proposal, checked.as_ref()));
    }
    Ok(passed)
}
