//! Command that re-runs a single run by seed.

use super::plan::{Campaign, Variant};
use sim::scenario::BuiltIn;

impl Campaign {
    /// The command that repeats run `index` in `variant` by itself, with trace and figures; numbers
    /// are exact. A scenario that is a file is named as the campaign names it.
    #[must_use]
    pub fn replay_command(&self, index: u32, variant: &Variant) -> String {
        self.command(variant, &self.values(index), self.seed(index))
    }

    /// The command that flies these values in `variant` by themselves.
    pub(super) fn command(&self, variant: &Variant, values: &[f64], seed: u32) -> String {
        let mut command = format!("sil-host run {}", quoted(&variant.scenario));
        for change in variant.changes(values, seed) {
            match change.strip_prefix("seed=") {
                Some(seed) => command += &format!(" --seed {seed}"),
                None => command += &format!(" --set {}", quoted(&change)),
            }
        }
        command
    }

    /// `true` if [`replay_command`](Self::replay_command) flies the scenario that this campaign does:
    /// not when the program has another one of that name.
    #[must_use]
    pub fn is_replayable_by_name(&self, variant: &Variant) -> bool {
        BuiltIn::named(&variant.scenario).is_none_or(|known| known.text == variant.text())
    }
}

/// An argument as a POSIX shell reads it.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=+,:".contains(c);
    if argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn only_what_a_shell_would_read_is_quoted() {
        assert_eq!(quoted("vehicle.mass=0.7"), "vehicle.mass=0.7");
        assert_eq!(quoted("vehicle.inertia[0]=0.1"), "'vehicle.inertia[0]=0.1'");
        assert_eq!(quoted("name=it's"), r"'name=it'\''s'");
    }
}
