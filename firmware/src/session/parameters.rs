//! Parameters of the chosen controller, by name and by index.

use core::mem::replace;

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};
use ctrl_core::controller::{AdaptiveController, ControllerConfig};
use link::{ControllerKind, Downlink, ParameterValue, Parameters, Rejection, Uplink};

use super::{HostSession, copy};
use crate::exchange::ControlStatus;
use crate::scenario::Tuning;

impl HostSession<'_> {
    /// Takes another controller, if it is valid and accepts the selected trajectory.
    pub(super) fn select_controller(&mut self, kind: ControllerKind) -> Result<(), Rejection> {
        let before = replace(&mut self.tuning.kind, kind);
        self.renew_law().inspect_err(|_| self.tuning.kind = before)
    }

    /// Takes a whole tuning that has flown on this vehicle or is built in, if the selected trajectory
    /// suits it.
    #[inline(never)]
    pub(super) fn tune(&mut self, tuning: &Tuning) -> Result<(), Rejection> {
        let before = replace(&mut self.tuning, *tuning);
        self.renew_law().inspect_err(|_| self.tuning = before)
    }

    /// Builds the law of the tuning and takes it, if it is valid and accepts the selected trajectory.
    #[inline(never)]
    fn renew_law(&mut self) -> Result<(), Rejection> {
        // By reference: a law is half a kilobyte of stack, once.
        let built = self.tuning.controller();
        let law = built.as_ref().map_err(|error| *error)?;
        if let Some(limits) = self.memory.references.limits() {
            law.accept_limits(limits.acceleration_bound, limits.step_period)?;
        }
        self.law = *law;
        self.law_changed = true;
        self.law_changes = self.law_changes.wrapping_add(1);
        self.in_force.changed = true;
        Ok(())
    }

    /// Both controllers' parameters and the choice of controller.
    #[must_use]
    pub fn tuning(&self) -> &Tuning {
        &self.tuning
    }

    /// Number of parameters of the chosen controller.
    #[must_use]
    pub fn parameter_count(&self) -> u16 {
        let count = match self.tuning.kind {
            ControllerKind::RobustAdaptive => RobustAdaptiveConfig::NAMES.len(),
            ControllerKind::Saturated => SaturatedConfig::NAMES.len(),
        };
        count as u16
    }

    /// Name and value of the parameter at `index`.
    #[must_use]
    pub fn parameter_at(&self, index: u16) -> Option<(&'static str, f32)> {
        match self.tuning.kind {
            ControllerKind::RobustAdaptive => self.tuning.robust_adaptive.parameter_at(index),
            ControllerKind::Saturated => self.tuning.saturated.parameter_at(index),
        }
    }

    /// Writes one parameter, as the message does.
    ///
    /// # Errors
    /// The reason for a rejection; the value is then unchanged.
    pub fn set_parameter(
        &mut self,
        name: &str,
        value: f32,
        status: ControlStatus,
    ) -> Result<(), Rejection> {
        if !status.on_ground() || self.storage.is_some() {
            return Err(Rejection::NotNow);
        }
        self.write_parameter(name, value)
    }

    /// Writes one parameter, if the whole configuration is then valid.
    pub(super) fn write_parameter(&mut self, name: &str, value: f32) -> Result<(), Rejection> {
        let before = self.tuning.replace_parameter(name, value);
        let before = before.ok_or(Rejection::UnknownParameter)?;
        self.renew_law().inspect_err(|_| {
            self.tuning.replace_parameter(name, before);
        })
    }

    /// The parameter that a message asks for.
    pub(super) fn read_parameter(&self, message: &Uplink) -> Result<Downlink, Rejection> {
        let index = match message {
            Uplink::ParameterAt { index } => Some(*index),
            Uplink::ParameterRead { name } => self.parameter_index(name),
            _ => None,
        };
        let index = index.ok_or(Rejection::UnknownParameter)?;
        let value = match self.tuning.kind {
            ControllerKind::RobustAdaptive => parameter_in(&self.tuning.robust_adaptive, index),
            ControllerKind::Saturated => parameter_in(&self.tuning.saturated, index),
        };
        value.map(Downlink::Parameter).ok_or(Rejection::UnknownParameter)
    }

    fn parameter_index(&self, name: &str) -> Option<u16> {
        match self.tuning.kind {
            ControllerKind::RobustAdaptive => {
                parameter_index_in(&self.tuning.robust_adaptive, name)
            }
            ControllerKind::Saturated => parameter_index_in(&self.tuning.saturated, name),
        }
    }
}

impl Tuning {
    /// Configuration of the chosen controller.
    #[must_use]
    pub fn config(&self) -> ControllerConfig {
        match self.kind {
            ControllerKind::RobustAdaptive => {
                ControllerConfig::RobustAdaptive(self.robust_adaptive)
            }
            ControllerKind::Saturated => ControllerConfig::Saturated(self.saturated),
        }
    }

    /// Sets a parameter of the chosen controller; returns its value before, none if it has no such
    /// parameter.
    fn replace_parameter(&mut self, name: &str, value: f32) -> Option<f32> {
        match self.kind {
            ControllerKind::RobustAdaptive => {
                replace_parameter_in(&mut self.robust_adaptive, name, value)
            }
            ControllerKind::Saturated => replace_parameter_in(&mut self.saturated, name, value),
        }
    }
}

fn replace_parameter_in<C: Parameters>(config: &mut C, name: &str, value: f32) -> Option<f32> {
    let field = config.field(C::parameter_index(name)?.into())?;
    Some(replace(field, value))
}

fn parameter_index_in<C: Parameters>(_: &C, name: &str) -> Option<u16> {
    C::parameter_index(name)
}

fn parameter_in<C: Parameters>(config: &C, index: u16) -> Option<ParameterValue> {
    let (name, value) = config.parameter_at(index)?;
    Some(ParameterValue { index, count: C::NAMES.len() as u16, name: copy(name), value })
}
