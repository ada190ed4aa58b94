//! README, docs and the crates' own pages: what they name exists.
//!
//! A path in `code`, a link and a script in a shell block must lead to a file or folder of this checkout. A link to a
//! heading needs that heading. A link of the book stays in the book: other files are named as code. Result files that a
//! command writes (`out/...`) are not part of the checkout and are not asked for.

use std::path::{Path, PathBuf};

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

use crate::support::built_command::{folder, run, succeeds};
use crate::support::checkout::{files_below, root, text};

/// What a document names.
#[derive(Debug, Default)]
struct Named {
    links: Vec<String>,
    code_spans: Vec<String>,
    shell: String,
    headings: Vec<String>,
}

/// Every Markdown file at the root, in the crates and in `docs`: in `src` are templates.
fn documents() -> Vec<PathBuf> {
    let mut found = files_below(&root(), "md");
    found.retain(|path| !path.iter().any(|part| part == "src"));
    assert!(found.iter().any(|path| path.ends_with("docs/EQUATIONS.md")), "{found:?}");
    found
}

/// The anchor that Git hosts and mdBook give to a heading.
fn anchor(heading: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    heading.chars().filter(kept).map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

fn named(document: &str) -> Named {
    let mut named = Named::default();
    let mut heading: Option<String> = None;
    let mut shell = false;
    let mut in_link = false;
    for event in Parser::new_ext(document, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                named.links.push(dest_url.into_string());
                in_link = true;
            }
            Event::End(TagEnd::Link | TagEnd::Image) => in_link = false,
            Event::Start(Tag::CodeBlock(kind)) => {
                shell = matches!(kind, CodeBlockKind::Fenced(language) if &*language == "sh");
            }
            Event::End(TagEnd::CodeBlock) => shell = false,
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                named.headings.extend(heading.take().map(|heading| anchor(&heading)));
            }
            Event::Text(text) if shell => named.shell.push_str(&text),
            Event::Text(text) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&text);
                }
            }
            Event::Code(code) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&code);
                }
                // The words of a link are a name; where it leads is looked at.
                if !in_link {
                    named.code_spans.push(code.into_string());
                }
            }
            _ => {}
        }
    }
    named
}

/// Whether a piece of code can only be meant as a path of the checkout: it begins with one of its folders, or ends like
/// a file of source.
fn is_path(code: &str, root: &Path) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '_' | '-' | '.');
    if !code.contains('/') || !code.chars().all(plain) || code.starts_with("out/") || code.starts_with('/') {
        return false;
    }
    let first = code.split('/').next().unwrap_or_default();
    let source = [".rs", ".md", ".sh", ".toml", ".x", ".py"].iter().any(|end| code.ends_with(end));
    source || (!first.is_empty() && first != "target" && root.join(first).is_dir())
}

/// Each link and each path leads somewhere.
#[test]
fn tool_documents_name_only_what_exists() {
    let root = root();
    let mut missing = Vec::new();
    for path in documents() {
        let folder = path.parent().expect("a folder");
        let place = path.strip_prefix(&root).expect("within the checkout").display().to_string();
        let named = named(&text(&path));
        for link in named.links.iter().filter(|link| !link.contains("://") && !link.starts_with("mailto:")) {
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { path.clone() } else { folder.join(file) };
            let in_book = place.starts_with("docs/");
            if !target.exists() {
                missing.push(format!("{place}: link {link}"));
            } else if in_book
                && !target.canonicalize().is_ok_and(|target| target.starts_with(root.join("docs")))
            {
                missing.push(format!("{place}: link {link} leads out of the book"));
            } else if !heading.is_empty()
                && !self::named(&text(&target)).headings.iter().any(|h| h == heading)
            {
                missing.push(format!("{place}: heading {link}"));
            }
        }
        let words = named
            .shell
            .split_whitespace()
            .filter(|word| root.join(word.split('/').next().unwrap_or_default()).is_dir());
        for code in
            named.code_spans.iter().map(String::as_str).chain(words).filter(|code| is_path(code, &root))
        {
            if !root.join(code).exists() && !folder.join(code).exists() {
                missing.push(format!("{place}: path {code}"));
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// The front page is short and names the two commands; every page of `docs` is in the table of contents.
#[test]
fn tool_documents_are_short_and_complete() {
    let root = root();
    let front = text(&root.join("README.md"));
    assert!(front.lines().count() <= 120, "README.md has {} lines", front.lines().count());
    for command in ["cargo run --release", "tests/run.sh"] {
        assert!(front.lines().any(|line| line.trim() == command), "{command}");
    }
    let contents = named(&text(&root.join("docs/SUMMARY.md"))).links;
    for path in documents() {
        let place = path.strip_prefix(&root).expect("within the checkout");
        if let Ok(page) = place.strip_prefix("docs")
            && page != Path::new("SUMMARY.md")
        {
            assert!(
                contents.iter().any(|link| Path::new(link) == page),
                "{} is not in SUMMARY.md",
                page.display()
            );
        }
    }
}

/// A line of at most 120 characters can be read without scrolling: in documents with their tables, in code with its
/// comments, which rustfmt leaves as they are. The maps of `host-sim/maps` are data that a command has written.
#[test]
fn tool_lines_have_at_most_120_characters() {
    let root = root();
    let files: Vec<PathBuf> = ["md", "rs", "toml", "sh", "py", "js", "css", "html"]
        .iter()
        .flat_map(|end| files_below(&root, end))
        .collect();
    for end in ["docs/results/filters.md", "motor-model/src/lib.rs", "rustfmt.toml", "tests/run.sh"] {
        assert!(files.iter().any(|path| path.ends_with(end)), "{end}");
    }
    let mut long = Vec::new();
    for path in files.into_iter().filter(|path| !path.starts_with(root.join("host-sim/maps"))) {
        let place = path.strip_prefix(&root).expect("within the checkout");
        let lines = text(&path);
        let numbered = lines.lines().enumerate().filter(|(_, line)| line.chars().count() > 120);
        long.extend(numbered.map(|(index, _)| format!("{}:{}", place.display(), index + 1)));
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
}

/// The figures among words: without signs and units.
fn figures(text: &str) -> Vec<&str> {
    let digits = |c: char| c.is_ascii_digit() || c == '.';
    text.split(|c| !digits(c)).map(|word| word.trim_matches('.')).filter(|word| !word.is_empty()).collect()
}

/// Each figure of the front page stands on the page that it names as its proof.
#[test]
fn tool_documents_take_the_front_page_from_the_results() {
    let root = root();
    let front = text(&root.join("README.md"));
    let in_table = |line: &&str| line.starts_with('|') && line.contains("](docs/results/");
    let rows: Vec<&str> = front.lines().filter(in_table).collect();
    assert_eq!(rows.len(), 8, "headline figures");
    for row in rows {
        // By either motor: question, height only, tilting, proof.
        let answer = row.split('|').skip(2).take(2).collect::<Vec<_>>().join(" ");
        assert!(row.split('|').count() == 6 && !figures(&answer).is_empty(), "an answer: {row}");
        let link = named(row).links.pop().expect("a page");
        let page = text(&root.join(&link));
        let proof = figures(&page);
        for figure in figures(&answer) {
            assert!(proof.contains(&figure), "README.md: {figure} of \"{}\" is not on {link}", answer.trim());
        }
    }
}

/// The first command ends on target with a motor that tilts, and draws the picture of the front page. The command that
/// it names for this says the same.
#[test]
fn tool_documents_show_what_the_first_command_does() {
    let folder = folder();
    let output = run(folder.path(), &[]);
    let [said, notes] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("text"));
    assert!(output.status.success(), "{notes}");
    assert!(said.contains(": on target\n") && said.contains("\nrotor              tilt "), "{said}");
    let drawn = text(&folder.path().join("out/position.svg"));
    let shown = text(&root().join("docs/images/position.svg"));
    assert!(drawn == shown, "run: cargo run --release && cp out/position.svg docs/images");

    let command =
        notes.split('`').nth(1).expect("a command").strip_prefix("host-sim ").expect("of this program");
    let repeated = succeeds(folder.path(), &command.split(' ').collect::<Vec<_>>());
    assert_eq!(repeated, said);
}

/// The test tells a path from a unit, and an anchor is what renderers make of a heading.
#[test]
fn tool_documents_are_read_as_meant() {
    let root = root();
    assert!(
        is_path("motor-model/src/lib.rs", &root)
            && is_path("docs/results", &root)
            && is_path("src/lost.rs", &root)
    );
    assert!(!is_path("deg/s", &root) && !is_path("out/position.svg", &root) && !is_path("a / b", &root));
    assert_eq!(anchor("From equation to file"), "from-equation-to-file");
    let named = named("# A `b` c\n\n[x](y.md#z) and `p/q`\n\n```sh\ntests/run.sh\n```\n");
    assert_eq!(named.headings, ["a-b-c"]);
    assert_eq!(named.links, ["y.md#z"]);
    assert_eq!(named.code_spans, ["b", "p/q"]);
    assert_eq!(named.shell, "tests/run.sh\n");
}
