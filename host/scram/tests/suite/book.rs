//! The documents: their examples run, their links lead somewhere, and the book lists them all.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::common::root;

/// Documents that are read as files and in the book, relative to the root.
const OUTSIDE_DOCS: [&str; 7] = [
    "README.md",
    "CONTRIBUTING.md",
    "ARCHITECTURE.md",
    "examples/another-rig/README.md",
    "examples/hidden-effect/README.md",
    "examples/hidden-effect/answer.md",
    "firmware/README.md",
];

/// Every document that is checked: those above and `docs/*.md`.
fn documents() -> Vec<PathBuf> {
    let docs = std::fs::read_dir(root().join("docs")).expect("docs/");
    let docs = docs.map(|entry| entry.expect("an entry of docs/").path());
    let mut all: Vec<PathBuf> = docs.filter(|path| path.extension().is_some_and(|end| end == "md")).collect();
    all.sort();
    all.extend(OUTSIDE_DOCS.map(|name| root().join(name)));
    all
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Lines with whether each is within a fenced block.
fn lines(text: &str) -> impl Iterator<Item = (bool, &str)> {
    let mut fenced = false;
    text.lines().map(move |line| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        (fenced || fence, line)
    })
}

/// Text of the blocks marked `sh run`, with the line at which each begins.
fn examples(text: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let mut inside = false;
    for (number, line) in text.lines().enumerate() {
        match line.trim_end() {
            "```sh run" => {
                inside = true;
                found.push((number + 2, String::new()));
            }
            "```" => inside = false,
            _ => {
                if let (true, Some((_, block))) = (inside, found.last_mut()) {
                    *block += &format!("{line}\n");
                }
            }
        }
    }
    found
}

/// A block of Rust, and the file that it says it is from.
struct Quotation {
    line: usize,
    from: Option<String>,
    text: String,
}

/// Every block of Rust.
fn quotations(text: &str) -> Vec<Quotation> {
    let mut found: Vec<Quotation> = Vec::new();
    let mut inside = false;
    for (number, line) in text.lines().enumerate() {
        match line.trim_end().strip_prefix("```") {
            Some(marked) if marked.starts_with("rust") => {
                inside = true;
                let from = marked.strip_prefix("rust from ").map(str::to_owned);
                found.push(Quotation { line: number + 1, from, text: String::new() });
            }
            Some(_) => inside = false,
            None => {
                if let (true, Some(quotation)) = (inside, found.last_mut()) {
                    quotation.text += &format!("{line}\n");
                }
            }
        }
    }
    found
}

/// Targets of `[text](target)` outside of fenced blocks and of code spans.
fn links(text: &str) -> Vec<String> {
    let prose: String = lines(text).filter(|(fenced, _)| !fenced).map(|(_, line)| format!("{line}\n")).collect();
    let prose: String = prose.split('`').enumerate().map(|(n, part)| if n % 2 == 0 { part } else { "code" }).collect();
    let targets = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    targets.map(|(target, _)| target.to_owned()).collect()
}

/// Anchors of a document's headings: lower case, spaces as hyphens, other punctuation gone.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = lines(text).filter(|(fenced, line)| !fenced && line.starts_with('#'));
    let anchor = |heading: &str| -> String {
        let kept = heading.trim_start_matches('#').trim().to_lowercase();
        kept.chars()
            .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
            .map(|c| if c == ' ' { '-' } else { c })
            .collect()
    };
    headings.map(|(_, line)| anchor(line)).collect()
}

#[test]
fn every_relative_link_leads_to_a_file_and_a_heading() {
    let mut dead = Vec::new();
    let mut checked = 0;
    for document in documents() {
        let text = read(&document);
        for link in links(&text).into_iter().filter(|link| !link.contains("://")) {
            checked += 1;
            let (file, heading) = link.split_once('#').map_or((link.as_str(), None), |(f, h)| (f, Some(h)));
            let target = match file {
                "" => document.clone(),
                file => document.parent().expect("a folder").join(file),
            };
            let found = target.exists() && heading.is_none_or(|heading| anchors(&read(&target)).contains(heading));
            if !found {
                dead.push(format!("{}: {link}", document.display()));
            }
        }
    }
    assert!(dead.is_empty(), "dead links:\n{}", dead.join("\n"));
    assert!(checked > 80, "only {checked} links were found");
}

#[test]
fn the_book_lists_every_document_once() {
    let summary: Vec<String> = links(&read(&root().join("docs/SUMMARY.md")));
    let listed: BTreeSet<&str> = summary.iter().map(String::as_str).collect();
    assert_eq!(listed.len(), summary.len(), "a document is listed twice");
    let docs = documents();
    let names = docs.iter().filter(|path| path.parent().is_some_and(|folder| folder.ends_with("docs")));
    let names: BTreeSet<&str> = names.filter_map(|path| path.file_name()?.to_str()).collect();
    let missing: Vec<_> = names.iter().filter(|name| **name != "SUMMARY.md" && !listed.contains(*name)).collect();
    assert!(missing.is_empty(), "not in docs/SUMMARY.md: {missing:?}");
}

/// Code in a document that is not in the sources teaches what is no longer so.
#[test]
fn what_documents_quote_is_in_the_sources() {
    let mut stale = Vec::new();
    let mut checked = 0;
    for document in documents() {
        for Quotation { line, from, text } in quotations(&read(&document)) {
            checked += 1;
            let at = format!("{}:{line}", document.display());
            match from {
                None => stale.push(format!("{at}: a block of Rust begins with ```rust from FILE")),
                // Whole lines: the quotation begins where a line does.
                Some(from) if !format!("\n{}", read(&root().join(&from))).contains(&format!("\n{text}")) => {
                    stale.push(format!("{at}: these lines are not in {from}:\n{text}"));
                }
                Some(_) => {}
            }
        }
    }
    assert!(stale.is_empty(), "{}", stale.join("\n"));
    assert!(checked >= 6, "only {checked} quotations were found");
}

#[test]
fn the_readme_is_short() {
    let count = read(&root().join("README.md")).lines().count();
    assert!(count <= 150, "README.md has {count} lines, at most 150");
}

/// Every block in a folder of its own that looks like the project's root.
#[cfg(unix)]
#[test]
fn the_examples_run() {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    let mut ran = 0;
    let program = Path::new(assert_cmd::cargo::cargo_bin!("scram"));
    for document in documents() {
        for (line, block) in examples(&read(&document)) {
            let folder = tempfile::tempdir().expect("a temporary folder");
            for name in ["robot.toml", "robots", "examples"] {
                symlink(root().canonicalize().expect("the root").join(name), folder.path().join(name)).expect("a link");
            }
            let words = block.replace("cargo run --release -- ", "scram ");
            let script = format!("set -e\nscram() {{ \"$SCRAM\" \"$@\"; }}\n{words}");
            let mut shell = Command::new("sh");
            shell.args(["-c", &script]).env("SCRAM", program).current_dir(folder.path());
            let output = shell.output().expect("sh");
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}:{line}:\n{block}{said}", document.display());
            ran += 1;
        }
    }
    assert!(ran >= 7, "only {ran} examples were found");
}
