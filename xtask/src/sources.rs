//! From an address to the source lines that it was compiled from.

use std::fmt;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Result, anyhow};

/// Folder of the core's sources.
const OWN: &str = "ctrl-core/src/";

/// One function on the way to an instruction, and the line in it.
pub struct Frame {
    /// Demangled, without generic arguments.
    pub function: String,
    /// File and line.
    pub line: String,
}

/// A place in the sources.
pub struct Place {
    /// Demangled, with generic arguments.
    pub function: String,
    /// Path as the compiler was given it.
    pub file: String,
    /// Line from 1.
    pub line: u32,
}

impl Frame {
    /// The innermost frame in the core's own sources: arithmetic of glam and of the standard
    /// library counts where the core uses it.
    pub fn own(frames: &[Self]) -> Option<&Self> {
        frames.iter().find(|frame| frame.line.starts_with(OWN)).or(frames.first())
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}  {}", self.line, self.function)
    }
}

/// An image's debug information.
pub struct Sources(Loader);

impl Sources {
    /// Opens an image.
    pub fn open(image: &Path) -> Result<Self> {
        Loader::new(image).map(Self).map_err(|error| anyhow!("debug information: {error}"))
    }

    /// The functions that `address` was inlined from, innermost first.
    pub fn frames(&self, address: u64) -> Result<Vec<Frame>> {
        self.try_frames(address).map_err(|error| anyhow!("debug information: {error}"))
    }

    /// File, line and function of everything that `address` was inlined from, innermost first.
    pub fn places(&self, address: u64) -> Result<Vec<Place>> {
        let place = || -> Result<_, Box<dyn std::error::Error>> {
            let (mut found, mut frames) = (Vec::new(), self.0.find_frames(address)?);
            while let Some(frame) = frames.next()? {
                let name = frame.function.as_ref().and_then(|name| name.raw_name().ok());
                let function = name.map(|name| format!("{:#}", rustc_demangle::demangle(&name)));
                let location = frame.location;
                found.push(Place {
                    function: function.unwrap_or_default(),
                    file: location.as_ref().and_then(|at| at.file).unwrap_or_default().into(),
                    line: location.and_then(|at| at.line).unwrap_or(0),
                });
            }
            Ok(found)
        };
        place().map_err(|error| anyhow!("debug information: {error}"))
    }

    fn try_frames(&self, address: u64) -> Result<Vec<Frame>, Box<dyn std::error::Error>> {
        let (mut found, mut frames) = (Vec::new(), self.0.find_frames(address)?);
        while let Some(frame) = frames.next()? {
            let name = frame.function.as_ref().and_then(|name| name.raw_name().ok());
            let function = name.map_or("?".into(), |name| {
                shorter(&format!("{:#}", rustc_demangle::demangle(&name)))
            });
            let line = frame.location.map_or("?".into(), |location| {
                let file = short(location.file.unwrap_or("?"));
                format!("{file}:{}", location.line.unwrap_or(0))
            });
            found.push(Frame { function, line });
        }
        Ok(found)
    }
}

/// A path from the project's folder on, or else its last three parts.
fn short(file: &str) -> String {
    if let Some(start) = file.find(OWN) {
        return file[start..].to_owned();
    }
    let parts: Vec<_> = Path::new(file).iter().map(|part| part.to_string_lossy()).collect();
    parts[parts.len().saturating_sub(3)..].join("/")
}

/// A function's name without its generic arguments, which fill lines.
fn shorter(name: &str) -> String {
    name.split("::<").next().unwrap_or(name).to_owned()
}
