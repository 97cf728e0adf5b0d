//! The few forms of shell commands that the documentation uses.

/// One command.
pub struct Command {
    pub words: Vec<String>,
    /// File that takes its output, after `>`.
    pub output: Option<String>,
}

/// The commands of a block: a line each, `\` continues one, `#` begins a comment.
pub fn commands(block: &str) -> Result<Vec<Command>, String> {
    let joined = block.replace("\\\n", " ");
    let lines =
        joined.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.map(command).collect()
}

fn command(line: &str) -> Result<Command, String> {
    let mut words = words(line)?;
    let redirect = words.iter().position(|word| word == ">");
    let output = redirect.map(|at| {
        let file = words.get(at + 1).cloned().unwrap_or_default();
        words.truncate(at);
        file
    });
    let assignments = words.iter().take_while(|word| is_assignment(word)).count();
    Ok(Command { words: words.split_off(assignments), output })
}

/// Words as a shell splits them, with single and double quotes, up to a comment.
fn words(line: &str) -> Result<Vec<String>, String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in line.chars() {
        match (quote, c) {
            (Some(open), _) if open == c => quote = None,
            (None, '\'' | '"') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, '#') if word.is_none() => break,
            (None, ' ') => words.extend(word.take()),
            (None, '|' | '&' | ';' | '$' | '<') => {
                return Err(format!("`{c}` is not understood here"));
            }
            _ => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    Ok(words)
}

fn is_assignment(word: &str) -> bool {
    let name = word.split_once('=').map_or("", |(name, _)| name);
    !name.is_empty()
        && name
            .bytes()
            .all(|byte| byte.is_ascii_uppercase() || byte.is_ascii_digit() || byte == b'_')
}

impl Command {
    /// The program's own arguments if the command runs `sil-host`, by name or by `cargo run`.
    pub fn sil_host(&self) -> Option<Vec<String>> {
        let after = |at: usize| Some(self.words[at + 1..].to_vec());
        match self.words.first()?.as_str() {
            "sil-host" => after(0),
            "cargo" if self.words.get(1)? == "run" => {
                let end = self.words.iter().position(|word| word == "--")?;
                let package = self.words[..end].windows(2).any(|pair| pair == ["-p", "sil-host"]);
                package.then(|| after(end))?
            }
            _ => None,
        }
    }

    /// `true` if the command builds the program with a cargo feature other than those that this test has.
    pub fn needs_missing_feature(&self) -> bool {
        let features = self.words.windows(2).filter(|pair| pair[0] == "--features");
        let mut features = features.flat_map(|pair| pair[1].split(','));
        features.any(|feature| match feature {
            "mcap" => !cfg!(feature = "mcap"),
            "parquet" => !cfg!(feature = "parquet"),
            "full" => !cfg!(all(feature = "mcap", feature = "parquet")),
            _ => false,
        })
    }
}
