//! Names that become parts of paths.

use std::fmt;

use super::error::nearest;

/// Longest name (characters).
const LENGTH_MAX: usize = 64;

/// Checks a name that becomes part of a file's path: one safe path component.
///
/// # Errors
/// The rule that the name breaks.
pub fn check_name(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > LENGTH_MAX || !name.chars().all(plain) {
        return Err(format!(
            "`{name}` must be made of 1 to {LENGTH_MAX} letters, digits, `-` and `_`: files are named after it"
        ));
    }
    Ok(())
}

/// Message for `name`, which is neither a file that can be read, for `reason`, nor one of the `known`
/// names of built-in `kind`.
#[must_use]
pub fn not_found<'a>(
    name: &str,
    reason: &dyn fmt::Display,
    kind: &str,
    known: impl Iterator<Item = &'a str>,
) -> String {
    let known: Vec<_> = known.collect();
    let hint = nearest(name, known.iter().copied())
        .map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"));
    format!("{reason}{hint}; built-in {kind}: {}", known.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_one_safe_component_of_a_path() {
        for name in ["a", "paper-saturated", "x_1", &"n".repeat(64)] {
            assert_eq!(check_name(name), Ok(()));
        }
        for name in
            ["", ".", "..", "../../etc/p", "a/b", "a\\b", "a b", "ä", "a\0", "C:", &"n".repeat(65)]
        {
            assert!(
                check_name(name).is_err_and(|message| message.contains("letters, digits")),
                "{name}"
            );
        }
    }

    #[test]
    fn a_misspelt_name_gets_the_nearest_one() {
        let error = "no such file";
        let message = |name| {
            not_found(name, &error, "scenarios", ["paper-saturated", "lemniscate"].into_iter())
        };
        assert!(message("paper-satruated").contains("did you mean `paper-saturated`?"));
        assert!(!message("zzz").contains("did you mean"));
    }
}
