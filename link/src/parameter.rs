//! Named parameters: every tunable number of a configuration, for reading and writing by name.
//!
//! Names are the paths of the configuration's fields as in a scenario file. The step period is not
//! among them: it belongs to the rate loop, not to the tuning. Values are not checked here: build
//! the controller from the changed configuration and keep it only if that succeeds.

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};

/// One parameter of the configuration `C`.
pub struct Parameter<C: 'static> {
    /// Path of the field, at most [`NAME_MAX`](super::NAME_MAX) bytes.
    pub name: &'static str,
    /// The field.
    field: fn(&mut C) -> &mut f32,
}

/// A configuration with named parameters.
pub trait Parameters: Copy + 'static {
    /// All parameters, in a fixed order.
    const TABLE: &'static [Parameter<Self>];

    /// Name and value of the parameter at `index`.
    fn parameter_at(mut self, index: u16) -> Option<(&'static str, f32)> {
        let parameter = Self::TABLE.get(usize::from(index))?;
        Some((parameter.name, *(parameter.field)(&mut self)))
    }

    /// Place of the parameter called `name`.
    #[must_use]
    fn parameter_index(name: &str) -> Option<u16> {
        let index = Self::TABLE.iter().position(|parameter| parameter.name == name)?;
        u16::try_from(index).ok()
    }

    /// The configuration with the parameter called `name` set to `value`; none if there is no such
    /// parameter.
    #[must_use]
    fn with_parameter(mut self, name: &str, value: f32) -> Option<Self> {
        let parameter = Self::TABLE.iter().find(|parameter| parameter.name == name)?;
        *(parameter.field)(&mut self) = value;
        Some(self)
    }

    /// All values, in the order of the table, as many as there is room for.
    fn read_all(mut self, values: &mut [f32]) {
        for (value, parameter) in values.iter_mut().zip(Self::TABLE) {
            *value = *(parameter.field)(&mut self);
        }
    }

    /// The configuration with the first parameters of the table set to `values`.
    #[must_use]
    fn with_all(mut self, values: &[f32]) -> Self {
        for (value, parameter) in values.iter().zip(Self::TABLE) {
            *(parameter.field)(&mut self) = *value;
        }
        self
    }
}

/// The table of a configuration: its own fields, then those that both have.
macro_rules! table {
    ($config:ty: $($own:literal => $($field:ident).+,)*) => {
        table!(@ $config:
            $($own => $($field).+,)*
            "reference_acceleration_max" => reference_acceleration_max,
            "cascade.k1" => cascade.k1,
            "cascade.k2" => cascade.k2,
            "cascade.k3" => cascade.k3,
            "cascade.c" => cascade.c,
            "cascade.M1" => cascade.m1,
            "cascade.M2" => cascade.m2,
            "cascade.gamma1" => cascade.gamma1,
            "cascade.delta_1" => cascade.delta_1,
            "cascade.delta_min_translation" => cascade.delta_min_translation,
            "cascade.delta_min_rotation" => cascade.delta_min_rotation,
            "uncertainty.mass.lower" => uncertainty.mass.lower,
            "uncertainty.mass.upper" => uncertainty.mass.upper,
            "uncertainty.inertia.lower" => uncertainty.inertia.lower,
            "uncertainty.inertia.upper" => uncertainty.inertia.upper,
            "uncertainty.disturbance_acceleration" => uncertainty.disturbance_acceleration,
            "uncertainty.disturbance_torque" => uncertainty.disturbance_torque,
            "initial.mass" => initial.mass,
            "initial.inertia.x" => initial.inertia.x,
            "initial.inertia.y" => initial.inertia.y,
            "initial.inertia.z" => initial.inertia.z,
            "integral.acceleration_max" => integral.acceleration_max,
            "integral.gamma_d" => integral.gamma_d,
            "integral.torque_max" => integral.torque_max,
            "integral.gamma_t" => integral.gamma_t,
        );
    };
    (@ $config:ty: $($name:literal => $($field:ident).+,)*) => {
        impl Parameters for $config {
            const TABLE: &'static [Parameter<Self>] =
                &[$(Parameter { name: $name, field: |config| &mut config.$($field).+ }),*];
        }
    };
}

table!(RobustAdaptiveConfig: "k4" => k4, "gamma2" => gamma2,);
table!(SaturatedConfig:
    "thrust_max" => thrust_max,
    "torque_max" => torque_max,
    "k4" => k4,
    "k5" => k5,
    "gamma2" => gamma2,
    "gamma3" => gamma3,
);
