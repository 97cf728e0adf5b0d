//! Rust source files without comments and tests.

use std::fs;
use std::path::{Path, PathBuf};

/// A source file of a library.
#[derive(Clone, Debug)]
pub struct Source {
    path: PathBuf,
    code: String,
}

impl Source {
    /// The file `path`, relative to its library's `src`, with the content `text`.
    pub fn new(path: impl Into<PathBuf>, text: &str) -> Self {
        Self { path: path.into(), code: without_tests(&without_comments(text)) }
    }

    /// Every source file below `root`, except for files that only tests declare.
    pub fn all_under(root: &Path) -> Vec<Self> {
        let mut files = Vec::new();
        collect(root, &mut files);
        files.sort();
        let relative = |file: &PathBuf| file.strip_prefix(root).expect("below root").to_owned();
        let read = |file: &PathBuf| fs::read_to_string(file).expect("a source file is readable");
        let tests: Vec<_> =
            files.iter().flat_map(|it| test_modules(&relative(it), &read(it))).collect();
        files
            .iter()
            .filter(|file| !tests.iter().any(|test| is_part(&relative(file), test)))
            .map(|file| Self::new(relative(file), &read(file)))
            .collect()
    }

    /// Path relative to the library's `src`.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text without comments and without `#[cfg(test)]` modules; lines keep their numbers.
    pub fn code(&self) -> &str {
        &self.code
    }

    /// `true` for files of a program: `main.rs`, and the folders `cli` and `bin`.
    pub fn is_program(&self) -> bool {
        ["main.rs", "cli", "bin"].iter().any(|program| self.path.starts_with(program))
    }

    /// Module path within the library, empty for `lib.rs`.
    pub fn module(&self) -> Vec<String> {
        module_of(&self.path)
    }
}

/// Module path of a source file.
fn module_of(path: &Path) -> Vec<String> {
    let path = path.with_extension("");
    let mut parts: Vec<_> = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if parts.last().is_some_and(|last| last == "mod" || last == "lib") {
        parts.pop();
    }
    parts
}

fn collect(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("a source folder is readable") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Modules that `file` declares as files for tests only.
fn test_modules(file: &Path, text: &str) -> Vec<Vec<String>> {
    let mut modules = Vec::new();
    let mut lines = text.lines().map(str::trim);
    while let Some(line) = lines.next() {
        if !(line.starts_with("#[cfg(test)]") || line.starts_with("#[cfg(any(test")) {
            continue;
        }
        let declaration = lines.clone().find(|line| !line.starts_with("#[")).unwrap_or_default();
        let name = declaration.rsplit("mod ").next().and_then(|name| name.strip_suffix(';'));
        if let Some(name) = name.filter(|_| declaration.contains("mod ")) {
            modules.push([module_of(file), vec![name.to_owned()]].concat());
        }
    }
    modules
}

fn is_part(file: &Path, module: &[String]) -> bool {
    module_of(file).starts_with(module)
}

/// `text` with comments blanked; strings stay.
fn without_comments(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    for line in text.lines() {
        code.push_str(&line[..comment_start(line)]);
        code.push('\n');
    }
    code
}

/// Start of the line comment of `line`: the first `//` that no string literal on the line holds.
fn comment_start(line: &str) -> usize {
    let (mut quoted, mut escaped) = (false, false);
    for (index, character) in line.char_indices() {
        match character {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            '/' if !quoted && line[index..].starts_with("//") => return index,
            _ => {}
        }
    }
    line.len()
}

/// `code` with `#[cfg(test)]` modules blanked: the module ends where a brace stands in the first column.
fn without_tests(code: &str) -> String {
    let (mut kept, mut lines) = (String::with_capacity(code.len()), code.lines().peekable());
    while let Some(line) = lines.next() {
        let inline = line == "#[cfg(test)]"
            && lines.peek().is_some_and(|next| next.starts_with("mod ") && next.ends_with('{'));
        if inline {
            kept.push('\n');
            for line in lines.by_ref() {
                kept.push('\n');
                if line == "}" {
                    break;
                }
            }
        } else {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// `code` with the content of string literals blanked.
pub fn without_strings(code: &str) -> String {
    let (mut quoted, mut escaped) = (false, false);
    let mut previous = ' ';
    code.chars()
        .map(|character| {
            let shown = match character {
                '\n' => '\n',
                _ if escaped => {
                    escaped = false;
                    ' '
                }
                '\\' if quoted => {
                    escaped = true;
                    ' '
                }
                '"' if previous != '\'' => {
                    quoted = !quoted;
                    '"'
                }
                _ if quoted => ' ',
                other => other,
            };
            previous = character;
            shown
        })
        .collect()
}
