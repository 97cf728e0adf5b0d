//! Links between pages.

use std::path::Path;

use super::Page;

/// Links of a page to files or headings that do not exist.
pub fn broken(root: &Path, page: &Page) -> Vec<String> {
    let folder = root.join(&page.name).parent().expect("a folder").to_owned();
    let links =
        page.text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link);
    let local = links.filter(|link| !link.contains("://") && !link.contains(char::is_whitespace));
    local.filter_map(|link| check(&folder, page, link).err()).collect()
}

fn check(folder: &Path, page: &Page, link: &str) -> Result<(), String> {
    let (file, heading) = link.split_once('#').unwrap_or((link, ""));
    let path = folder.join(file);
    let found = file.is_empty() || path.exists();
    found.then_some(()).ok_or(format!("{}: no file {link}", page.name))?;
    if heading.is_empty() {
        return Ok(());
    }
    let text = if file.is_empty() { Ok(page.text.clone()) } else { std::fs::read_to_string(&path) };
    let text = text.map_err(|error| format!("{}: {link}: {error}", page.name))?;
    let mut headings = text.lines().filter(|line| line.starts_with('#'));
    let known = headings.any(|line| anchor(line) == heading);
    known.then_some(()).ok_or(format!("{}: no heading {link}", page.name))
}

/// The anchor that GitHub gives a heading.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}
