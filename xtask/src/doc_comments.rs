//! The register of doc comments: a noun phrase for a thing, a third-person verb for a function.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// Openings of a question clause.
const QUESTION_WORDS: [&str; 6] = ["What", "How", "Where", "Why", "Who", "Whether"];

/// Share of doc comments below which question words are accepted.
const SHARE_MAX: f64 = 0.01;

/// Folders with Rust sources.
const FOLDERS: [&str; 12] = [
    "ctrl-c",
    "ctrl-core",
    "examples",
    "firmware",
    "fuzz",
    "link",
    "mavlink-vehicle",
    "python",
    "sil-host",
    "sim",
    "tests",
    "xtask",
];

/// A doc comment that opens with a question word.
struct Finding {
    file: PathBuf,
    line: usize,
    text: String,
}

/// Counts the doc comments of all crates; an error if 1 % or more open with a question word.
pub fn check() -> Result<()> {
    let (mut comments, mut findings) = (0_usize, Vec::new());
    for folder in FOLDERS.map(Path::new) {
        for file in sources(folder)? {
            let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
            for (line, opening) in openings(&text) {
                comments += 1;
                if asks(opening) {
                    findings.push(Finding { file: file.clone(), line, text: opening.to_owned() });
                }
            }
        }
    }
    for Finding { file, line, text } in &findings {
        println!("{}:{line}: {text}", file.display());
    }
    let share = findings.len() as f64 / comments.max(1) as f64;
    println!("{} of {comments} doc comments open with a question word", findings.len());
    ensure!(
        share < SHARE_MAX,
        "{:.1} % of doc comments open with a question word, allowed are less than {:.0} %: open them \
         with a noun phrase or a third-person verb",
        100.0 * share,
        100.0 * SHARE_MAX
    );
    Ok(())
}

/// Rust files below `folder`, without build results; none if there is no such folder.
fn sources(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop().filter(|folder| folder.exists()) {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            if path.is_dir() && !path.ends_with("target") {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Line number and text of the first line of each doc comment.
fn openings(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut inside = false;
    text.lines().enumerate().filter_map(move |(index, line)| {
        let line = line.trim_start();
        let comment = ["///", "//!"].into_iter().find_map(|mark| line.strip_prefix(mark));
        let opens = !std::mem::replace(&mut inside, comment.is_some());
        comment.filter(|_| opens).map(|comment| (index + 1, comment.trim()))
    })
}

/// `true` if a doc comment opens with a question word.
fn asks(opening: &str) -> bool {
    let word = opening.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    QUESTION_WORDS.contains(&word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_of_each_comment_is_judged() {
        let text = "//! What it is.\n//! How it works.\n\n/// Length (m).\nfn a() {}\n    /// Whether\n    b\n// Why\n";
        let found: Vec<_> = openings(text).collect();
        assert_eq!(found, [(1, "What it is."), (4, "Length (m)."), (6, "Whether")]);
        let asking: Vec<_> = found.iter().map(|(_, opening)| asks(opening)).collect();
        assert_eq!(asking, [true, false, true]);
    }

    #[test]
    fn only_whole_words_count() {
        assert!(!asks("Whatever") && !asks("Whole image") && asks("How, then") && !asks(""));
    }
}
