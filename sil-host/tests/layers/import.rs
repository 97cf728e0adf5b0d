//! The import graph of a library's files.
//!
//! A file imports another if a path in it leads there. A `pub use` is an alias: who names it imports the
//! file that defines it, and a module file that only re-exports its children does not import them.
//!
//! A module's file may use its own parts (dispatch to them), or they may use what it defines: a circle that
//! needs both directions is the module itself, not a circle of modules.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use super::source::{Source, without_strings};

/// Files of a library and what each imports, by index.
#[derive(Debug)]
pub struct Graph {
    files: Vec<String>,
    modules: Vec<Vec<String>>,
    imports: Vec<BTreeSet<usize>>,
}

/// Re-exports that one name may pass through.
const ALIASES_MAX: usize = 8;

/// A `use` declaration's path, whether it is public, and the name that it gives.
struct Import {
    path: Vec<String>,
    name: String,
    public: bool,
}

/// Files by module path, and re-exported names with the path that they stand for.
struct Modules {
    files: BTreeMap<Vec<String>, usize>,
    aliases: BTreeMap<Vec<String>, Vec<String>>,
}

impl Graph {
    /// The graph of `sources`.
    pub fn new(sources: &[Source]) -> Self {
        let files = sources.iter().enumerate().map(|(index, it)| (it.module(), index)).collect();
        let mut modules = Modules { files, aliases: BTreeMap::new() };
        let mut paths = Vec::new();
        for source in sources {
            let module = source.module();
            let code = without_strings(source.code());
            let (uses, rest) = split_uses(&code);
            let mut used: Vec<_> = inline_paths(&rest);
            for import in uses.iter().flat_map(|text| imports(text)) {
                if import.public {
                    if let Some(path) = modules.absolute(&module, &import.path) {
                        modules.aliases.insert([module.clone(), vec![import.name]].concat(), path);
                    }
                } else {
                    used.push(import.path);
                }
            }
            paths.push((module, used));
        }
        let imports = paths.iter().enumerate().map(|(own, (module, used))| {
            let targets = used.iter().filter_map(|path| modules.file(module, path));
            targets.filter(|target| *target != own).collect()
        });
        Self {
            files: sources.iter().map(|it| it.path().display().to_string()).collect(),
            modules: sources.iter().map(Source::module).collect(),
            imports: imports.collect(),
        }
    }

    /// Number of imports between two files.
    pub fn edges(&self) -> usize {
        self.imports.iter().map(BTreeSet::len).sum()
    }

    /// One circle for each file that imports itself by way of others, in files, first and last the same;
    /// a circle is named once.
    pub fn circles(&self) -> Vec<String> {
        let down = self.without(is_ancestor);
        let up = self.without(|from, to| is_ancestor(to, from));
        let mut met = BTreeSet::new();
        let mut circles = Vec::new();
        for (graph, start) in [&down, &up]
            .into_iter()
            .flat_map(|graph| (0..self.files.len()).map(move |start| (graph, start)))
        {
            let Some(circle) = graph.shortest_circle(start) else { continue };
            let members: BTreeSet<_> = circle.iter().copied().collect();
            if met.insert(members) {
                let names: Vec<_> = circle.iter().map(|&file| self.files[file].as_str()).collect();
                circles.push(names.join(" -> "));
            }
        }
        circles
    }

    /// The graph without the imports whose two modules `is_dropped` selects.
    fn without(&self, is_dropped: impl Fn(&[String], &[String]) -> bool) -> Self {
        let keep = |(from, targets): (usize, &BTreeSet<usize>)| {
            let kept = |to: &&usize| !is_dropped(&self.modules[from], &self.modules[**to]);
            targets.iter().filter(kept).copied().collect()
        };
        let imports = self.imports.iter().enumerate().map(keep).collect();
        Self { files: self.files.clone(), modules: self.modules.clone(), imports }
    }

    /// The shortest way from `start` back to itself, by breadth-first search.
    fn shortest_circle(&self, start: usize) -> Option<Vec<usize>> {
        let mut from = BTreeMap::new();
        let mut frontier = vec![start];
        while !frontier.is_empty() {
            let mut next = Vec::new();
            for file in frontier {
                for &import in &self.imports[file] {
                    if import == start {
                        return Some(way_back(&from, start, file));
                    }
                    if let Entry::Vacant(place) = from.entry(import) {
                        place.insert(file);
                        next.push(import);
                    }
                }
            }
            frontier = next;
        }
        None
    }
}

/// `true` if the module `part` is inside the module `whole`.
fn is_ancestor(whole: &[String], part: &[String]) -> bool {
    whole.len() < part.len() && part.starts_with(whole)
}

fn way_back(from: &BTreeMap<usize, usize>, start: usize, last: usize) -> Vec<usize> {
    let mut way = vec![start, last];
    let mut file = last;
    while file != start {
        file = from[&file];
        way.push(file);
    }
    way.dedup();
    way.reverse();
    way
}

impl Modules {
    /// `path`, as written in `module`, from the library's root; nothing for other crates' paths.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Vec<String>> {
        let first = path.first()?.as_str();
        let supers = path.iter().take_while(|part| *part == "super").count();
        match first {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([module, &path[1..]].concat()),
            "super" => {
                let base = module.get(..module.len().checked_sub(supers)?)?;
                Some([base, &path[supers..]].concat())
            }
            _ => {
                let child = [module, &path[..1]].concat();
                let known = self.files.contains_key(&child) || self.aliases.contains_key(&child);
                known.then(|| [module, path].concat())
            }
        }
    }

    /// The file that `path`, as written in `module`, leads to.
    fn file(&self, module: &[String], path: &[String]) -> Option<usize> {
        let mut path = self.absolute(module, path)?;
        for _ in 0..ALIASES_MAX {
            let alias = (1..=path.len()).rev().find_map(|length| {
                let head = &path[..length];
                // A function may be re-exported beside its module of the same name: more parts mean the module.
                let module = length < path.len() && self.files.contains_key(head);
                let target = self.aliases.get(head).filter(|_| !module)?;
                Some([target.as_slice(), &path[length..]].concat())
            });
            let Some(next) = alias else { break };
            path = next;
        }
        // A module alone (`use crate::figure;`) is that file; the root names no file by itself.
        (1..=path.len()).rev().find_map(|length| self.files.get(&path[..length]).copied())
    }
}

/// The texts of the `use` declarations of `code`, and the rest of it.
fn split_uses(code: &str) -> (Vec<String>, String) {
    let (mut uses, mut rest) = (Vec::new(), String::new());
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        let text = line.trim_start();
        let starts = text.starts_with("use ")
            || text.starts_with("pub") && text.split_whitespace().nth(1) == Some("use");
        if !starts {
            rest.push_str(line);
            rest.push('\n');
            continue;
        }
        let mut declaration = text.to_owned();
        while !declaration.contains(';') {
            declaration += lines.next().expect("a use declaration ends");
        }
        uses.push(declaration.split(';').next().unwrap_or_default().to_owned());
    }
    (uses, rest)
}

/// The single imports of a `use` declaration.
fn imports(declaration: &str) -> Vec<Import> {
    let public = declaration.starts_with("pub");
    let tree = declaration.split_once("use ").map_or("", |(_, tree)| tree);
    let mut all = Vec::new();
    expand(tree.trim(), &[], public, &mut all);
    all
}

fn expand(tree: &str, prefix: &[String], public: bool, all: &mut Vec<Import>) {
    if let Some((head, group)) = tree.split_once('{') {
        let group = group.trim_end().strip_suffix('}').unwrap_or(group);
        let prefix = [prefix, &parts(head)].concat();
        for part in top_level(group) {
            expand(part.trim(), &prefix, public, all);
        }
        return;
    }
    let (path, name) = tree.split_once(" as ").unwrap_or((tree, ""));
    let mut path = [prefix, &parts(path)].concat();
    if prefix.len() + 1 == path.len() && path.last().is_some_and(|last| last == "self") {
        path.pop();
    }
    let last = path.last().cloned().unwrap_or_default();
    let name = if name.is_empty() { last } else { name.trim().to_owned() };
    if !path.is_empty() && name != "*" {
        all.push(Import { path, name, public });
    } else if name == "*" {
        path.pop();
        all.push(Import { path, name, public });
    }
}

fn parts(path: &str) -> Vec<String> {
    path.split("::").map(str::trim).filter(|part| !part.is_empty()).map(str::to_owned).collect()
}

/// `group` split at the commas outside inner braces.
fn top_level(group: &str) -> Vec<&str> {
    let (mut depth, mut start, mut all) = (0, 0, Vec::new());
    for (index, character) in group.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                all.push(&group[start..index]);
                start = index + 1;
            }
            _ => {}
        }
    }
    all.push(&group[start..]);
    all.retain(|part| !part.trim().is_empty());
    all
}

/// Paths with two parts or more in `code` outside `use` declarations.
fn inline_paths(code: &str) -> Vec<Vec<String>> {
    let words = code.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    words.filter(|word| word.contains("::")).map(parts).filter(|path| path.len() > 1).collect()
}
