//! The C header, generated from the sources of `ctrl-c` and checked in.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};

/// The checked-in header.
pub const HEADER: &str = "ctrl-c/include/gyrfalcon.h";
const SETTINGS: &str = "ctrl-c/cbindgen.toml";
/// Sources in the order of the header's content.
const SOURCES: [&str; 7] =
    ["result", "types", "config", "refusal", "controller", "flight", "checkpoint"];
/// Sections of a Rust doc comment that a reader of C has no use for.
const SAFETY: &str = "\n *\n * # Safety";

/// Writes the header anew.
pub fn write() -> Result<()> {
    std::fs::write(HEADER, generate()?).context(HEADER)
}

/// Fails unless the checked-in header is what the sources give.
pub fn check() -> Result<()> {
    let found = std::fs::read_to_string(HEADER).context(HEADER)?;
    ensure!(
        found == generate()?,
        "{HEADER} is not what the sources give: run `cargo xtask c-library header`"
    );
    println!("{HEADER} is what the sources give");
    Ok(())
}

fn generate() -> Result<String> {
    let config = cbindgen::Config::from_file(SETTINGS).map_err(|error| anyhow!("{error}"))?;
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in SOURCES {
        builder = builder.with_src(Path::new("ctrl-c/src").join(source).with_extension("rs"));
    }
    let mut text = Vec::new();
    builder.generate().context("cbindgen")?.write(&mut text);
    let text = String::from_utf8(text).context("the header")?;
    if let Some(name) = rust_name(&text) {
        bail!("{name} has no name in C: add it to [export.rename] of {SETTINGS}");
    }
    Ok(for_readers_of_c(&text))
}

/// The first type that has no name of its own in C yet.
fn rust_name(header: &str) -> Option<&str> {
    let not_in_a_name = |letter: char| !letter.is_ascii_alphanumeric() && letter != '_';
    let is_type = |word: &&str| word.strip_prefix("Gyrfalcon").is_some_and(|rest| !rest.is_empty());
    header.split(not_in_a_name).find(is_type)
}

/// Replaces what only Rust's documentation understands.
fn for_readers_of_c(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(SAFETY) {
        kept += &rest[..start];
        let end = rest[start..].find("\n */").map_or(rest.len(), |end| start + end);
        rest = &rest[end..];
    }
    kept += rest;
    kept.replace("[`", "`").replace("`]", "`")
}

#[cfg(test)]
mod tests {
    use super::{for_readers_of_c, rust_name};

    #[test]
    fn sections_about_safety_and_links_are_left_out() {
        let text = "/*\n * Text of [`a`].\n *\n * # Safety\n * None.\n */\nint f(void);\n";
        assert_eq!(for_readers_of_c(text), "/*\n * Text of `a`.\n */\nint f(void);\n");
    }
    #[test]
    fn a_type_without_a_name_in_c_is_found() {
        assert_eq!(rust_name("/* Gyrfalcon's */ gyrfalcon_config *config;"), None);
        assert_eq!(rust_name("    GyrfalconIntegral integral;"), Some("GyrfalconIntegral"));
    }
}
