//! Code blocks and code spans of a Markdown page.

/// The language of a block, by its info string or, indented, by its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    Shell,
    Toml,
    Rust,
    Python,
    /// Nothing to run.
    Text,
    /// Bytes in hex.
    Bytes,
    /// None of these.
    Unknown,
}

/// A fenced or indented block.
pub struct Block {
    /// Line of its first line of code, from one.
    pub line: usize,
    pub language: Language,
    pub text: String,
    /// Reason in a comment `<!-- not run: REASON -->` above the block.
    pub not_run: Option<String>,
}

/// Words with which an indented block of commands begins.
const PROGRAMS: [&str; 4] = ["cargo", "sil-host", "probe-rs", "rustup"];

/// The blocks of a page in order.
pub fn blocks(page: &str) -> Vec<Block> {
    let lines: Vec<_> = page.lines().collect();
    let (mut blocks, mut marker, mut i) = (Vec::new(), None, 0);
    while i < lines.len() {
        let line = lines[i];
        if let Some(info) = line.strip_prefix("```") {
            let length = lines[i + 1..].iter().take_while(|line| !line.starts_with("```")).count();
            let text = lines[i + 1..i + 1 + length].join("\n");
            let language = by_name(info.trim());
            blocks.push(Block { line: i + 2, language, text, not_run: marker.take() });
            i += length + 2;
        } else if is_indented(line)
            && (i == 0 || lines[i - 1].trim().is_empty())
            && !in_list(&lines[..i])
        {
            let inside = |line: &&&str| is_indented(line) || line.trim().is_empty();
            let length = lines[i..].iter().take_while(inside).count();
            let code: Vec<_> =
                lines[i..i + length].iter().map(|line| line.trim_start_matches("    ")).collect();
            let text = code.join("\n").trim_end().to_owned();
            let language = by_content(&text);
            blocks.push(Block { line: i + 1, language, text, not_run: marker.take() });
            i += length;
        } else {
            if !line.trim().is_empty() {
                marker = reason(line);
            }
            i += 1;
        }
    }
    blocks
}

/// The inline code of a page, outside its blocks.
pub fn code_spans(page: &str) -> impl Iterator<Item = String> {
    let mut fenced = false;
    let outside = page.lines().filter(move |line| {
        fenced ^= line.starts_with("```");
        !fenced && !line.starts_with("```")
    });
    let text = outside.collect::<Vec<_>>().join("\n");
    let spans: Vec<_> = text.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    spans.into_iter()
}

fn reason(line: &str) -> Option<String> {
    let comment = line.trim().strip_prefix("<!-- not run:")?.strip_suffix("-->")?;
    Some(comment.trim().to_owned())
}

fn is_indented(line: &str) -> bool {
    line.starts_with("    ") && !line.trim().is_empty()
}

/// `true` if what is indented continues an item of a list.
fn in_list(before: &[&str]) -> bool {
    let mut lines = before.iter().rev().filter(|line| !line.trim().is_empty());
    let item = |line: &&&str| {
        let number = line.trim_start_matches(|c: char| c.is_ascii_digit());
        line.starts_with("- ") || (number.len() < line.len() && number.starts_with(". "))
    };
    lines.find(|line| !line.starts_with(' ')).is_some_and(|line| item(&line))
}

fn by_name(info: &str) -> Language {
    match info {
        "sh" => Language::Shell,
        "toml" => Language::Toml,
        "rust" => Language::Rust,
        "python" => Language::Python,
        "text" => Language::Text,
        _ => Language::Unknown,
    }
}

fn by_content(text: &str) -> Language {
    let mut words = text.split_whitespace();
    let hex = |word: &str| word.len() == 2 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    if words.clone().all(hex) {
        Language::Bytes
    } else if words.next().is_some_and(|word| PROGRAMS.contains(&word)) {
        Language::Shell
    } else {
        Language::Unknown
    }
}
