//! Named parameters: every tunable number of a configuration, for reading and writing by name.
//!
//! Names are the paths of the configuration's fields as in a scenario file. The step period is not
//! among them: it belongs to the rate loop, not to the tuning. Values are not checked here: build
//! the controller from the changed configuration and keep it only if that succeeds.

use ctrl_core::config::{RobustAdaptiveConfig, SaturatedConfig};

/// A configuration with named parameters.
pub trait Parameters: Copy + 'static {
    /// Names of all parameters in a fixed order: paths of fields, at most
    /// [`NAME_MAX`](super::NAME_MAX) bytes each.
    const NAMES: &'static [&'static str];

    /// Value of the parameter at `index`.
    fn value(&self, index: usize) -> Option<f32>;

    /// The field of the parameter at `index`.
    fn field(&mut self, index: usize) -> Option<&mut f32>;

    /// A number of each name, in the same order, so that a name is found without comparing all of them.
    const HASHES: &'static [u32];

    /// Name and value of the parameter at `index`.
    fn parameter_at(&self, index: u16) -> Option<(&'static str, f32)> {
        let index = usize::from(index);
        Some((Self::NAMES.get(index)?, self.value(index)?))
    }

    /// Place of the parameter called `name`.
    #[must_use]
    fn parameter_index(name: &str) -> Option<u16> {
        let wanted = hash(name);
        // wcet: at most 64 iterations
        let index = Self::HASHES.iter().position(|hash| *hash == wanted)?;
        // wcet: at most 48 bytes
        let is_it = *Self::NAMES.get(index)? == name;
        u16::try_from(index).ok().filter(|_| is_it)
    }

    /// The configuration with the parameter called `name` set to `value`; none if there is no such
    /// parameter.
    #[must_use]
    fn with_parameter(mut self, name: &str, value: f32) -> Option<Self> {
        let index = Self::parameter_index(name)?;
        *self.field(index.into())? = value;
        Some(self)
    }

    /// All values, in the order of the table, as many as there is room for.
    fn read_all(&self, values: &mut [f32]) {
        for (index, value) in values.iter_mut().enumerate() {
            if let Some(own) = self.value(index) {
                *value = own;
            }
        }
    }

    /// The configuration with the first parameters of the table set to `values`.
    #[must_use]
    fn with_all(mut self, values: &[f32]) -> Self {
        for (index, value) in values.iter().enumerate() {
            if let Some(field) = self.field(index) {
                *field = *value;
            }
        }
        self
    }
}

/// FNV-1a of a name; no two of a table have the same, which is tested.
const fn hash(name: &str) -> u32 {
    let (bytes, mut hash, mut place) = (name.as_bytes(), 0x811C_9DC5, 0);
    // wcet: at most 48 iterations
    while place < bytes.len() {
        hash = (hash ^ bytes[place] as u32).wrapping_mul(0x0100_0193);
        place += 1;
    }
    hash
}

/// The table of a configuration: its own fields, then those that both have; `[field]` is a vector, one
/// parameter per axis. The fields are reached by comparing indices, not by function pointers, which a
/// static bound of the stack could not follow.
macro_rules! table {
    ($config:ty: $($own:tt)*) => {
        table!(@ $config; []; $($own)*
            "reference_acceleration_max" => reference_acceleration_max,
            "cascade.k1" => cascade.k1,
            "cascade.k2" => cascade.k2,
            "cascade.k3" => [cascade.k3],
            "cascade.c" => cascade.c,
            "cascade.M1" => cascade.m1,
            "cascade.M2" => cascade.m2,
            "cascade.gamma1" => cascade.gamma1,
            "cascade.delta_1" => cascade.delta_1,
            "cascade.delta_min_translation" => cascade.delta_min_translation,
            "cascade.delta_min_rotation" => cascade.delta_min_rotation,
            "uncertainty.mass.lower" => uncertainty.mass.lower,
            "uncertainty.mass.upper" => uncertainty.mass.upper,
            "uncertainty.inertia.lower" => [uncertainty.inertia.lower],
            "uncertainty.inertia.upper" => [uncertainty.inertia.upper],
            "uncertainty.disturbance_acceleration" => uncertainty.disturbance_acceleration,
            "uncertainty.disturbance_torque" => [uncertainty.disturbance_torque],
            "initial.mass" => initial.mass,
            "initial.inertia" => [initial.inertia],
            "integral.acceleration_max" => integral.acceleration_max,
            "integral.gamma_d" => integral.gamma_d,
            "integral.torque_max" => integral.torque_max,
            "integral.gamma_t" => integral.gamma_t,
            "rotors.lag" => rotors.lag,
            "rotors.residual_lag" => rotors.residual_lag,
        );
    };
    (@ $config:ty; [$($done:tt)*]; $name:literal => [$($field:ident).+], $($rest:tt)*) => {
        table!(@ $config; [
            $($done)*
            (concat!($name, ".x")) => ($($field).+.x),
            (concat!($name, ".y")) => ($($field).+.y),
            (concat!($name, ".z")) => ($($field).+.z),
        ]; $($rest)*);
    };
    (@ $config:ty; [$($done:tt)*]; $name:literal => $($field:ident).+, $($rest:tt)*) => {
        table!(@ $config; [$($done)* ($name) => ($($field).+),]; $($rest)*);
    };
    (@ $config:ty; [$(($name:expr) => ($($field:ident).+),)*];) => {
        impl Parameters for $config {
            const NAMES: &'static [&'static str] = &[$($name),*];
            const HASHES: &'static [u32] = &[$(hash($name)),*];

            fn value(&self, index: usize) -> Option<f32> {
                let mut from = 0..;
                $(
                    if from.next() == Some(index) {
                        return Some(self.$($field).+);
                    }
                )*
                None
            }

            fn field(&mut self, index: usize) -> Option<&mut f32> {
                let mut from = 0..;
                $(
                    if from.next() == Some(index) {
                        return Some(&mut self.$($field).+);
                    }
                )*
                None
            }
        }
    };
}

table!(RobustAdaptiveConfig: "k4" => [k4], "gamma2" => [gamma2],);
table!(SaturatedConfig:
    "thrust_max" => thrust_max,
    "torque_max" => [torque_max],
    "k4" => [k4],
    "k5" => k5,
    "gamma2" => [gamma2],
    "gamma3" => gamma3,
);
