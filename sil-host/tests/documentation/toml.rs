//! TOML blocks, read by the program as what they are.

use toml_edit::DocumentMut;

use super::program::Program;

/// Has the program read `text`.
pub fn check(program: &Program, text: &str) -> Result<(), String> {
    let document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
    let has = |key: &str| document.contains_key(key);
    if has("sampling") {
        program.read_campaign(text)
    } else if has("mass") {
        program.read_vehicle(text)
    } else if has("trajectory") && has("controller") {
        program.read_scenario(text)
    } else {
        program.read_scenario(&completed(program, &document)?)
    }
}

/// The built-in scenario `paper-saturated` with the tables of `part` in place of its own.
fn completed(program: &Program, part: &DocumentMut) -> Result<String, String> {
    let scenario = program.built_in("paper-saturated")?;
    let mut scenario: DocumentMut = scenario.parse().map_err(|error| format!("{error}"))?;
    for (key, value) in part.iter() {
        scenario.insert(key, value.clone());
    }
    Ok(scenario.to_string())
}
