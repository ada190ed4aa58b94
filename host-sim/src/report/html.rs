//! The report on a run or a study as one HTML file: pictures first, readable without scripts, nothing loaded from
//! anywhere.
//!
//! The order is the same for every command: what was asked, pictures, what happened, how sure that is, what it cost,
//! what is not modelled, how to repeat it. All text is escaped. The policy in the head forbids every request.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::chart::Figure;
use super::document::{Block, Document};
use super::table::Table;

const STYLE: &str = include_str!("html/style.css");
const SCRIPT: &str = include_str!("html/script.js");
/// What a page may do: its own style and script, no request.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// A table of more columns is printed smaller.
const WIDE_COLUMNS: usize = 9;

/// A report on a run or a study.
#[derive(Clone, Debug)]
pub(crate) struct HtmlReport {
    /// What was done, in a few words.
    pub(crate) title: String,
    /// How it ended, in one sentence.
    pub(crate) verdict: String,
    /// What was asked.
    pub(crate) asked: Document,
    /// The pictures.
    pub(crate) figures: Vec<Figure>,
    /// What happened.
    pub(crate) happened: Document,
    /// How sure that is.
    pub(crate) sure: Document,
    /// What it cost.
    pub(crate) cost: Document,
    /// What is not modelled, a sentence each.
    pub(crate) not_modelled: Vec<String>,
}

/// What repeats a run.
#[derive(Clone, Debug)]
pub(crate) struct Repetition {
    /// The command as it was given.
    pub(crate) given: String,
    /// What the scene sets, as a scene file: empty if it sets nothing, `None` if the command takes no scene.
    pub(crate) scene: Option<String>,
    /// The command with that file; empty if there is none.
    pub(crate) with_scene: String,
}

impl HtmlReport {
    /// The file.
    pub(crate) fn page(&self, repetition: &Repetition) -> String {
        let sections = [
            ("asked", "What was asked", blocks(&self.asked)),
            ("pictures", "Pictures", html! { @for figure in &self.figures { (figure.html()) } }),
            ("happened", "What happened", blocks(&self.happened)),
            ("sure", "How sure this is", blocks(&self.sure)),
            ("cost", "What it cost", blocks(&self.cost)),
            ("not-modelled", "What is not modelled", sentences(&self.not_modelled)),
            ("repeat", "How to repeat it", repetition.html()),
        ];
        let version = env!("CARGO_PKG_VERSION");
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    meta name="generator" content={ "host-sim " (version) };
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    header {
                        h1 { (self.title) }
                        p.verdict { (prose(&self.verdict)) }
                        nav aria-label="Sections" {
                            ul { @for (id, heading, _) in &sections { li { a href={ "#" (id) } { (heading) } } } }
                        }
                    }
                    main {
                        @for (id, heading, content) in &sections {
                            section id=(id) aria-labelledby={ (id) "-heading" } {
                                h2 id={ (id) "-heading" } { (heading) }
                                (content)
                            }
                        }
                    }
                    footer { p { "Written by host-sim " (version) "." } }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        };
        page.into_string()
    }
}

impl Repetition {
    fn html(&self) -> Markup {
        html! {
            p { "This command was given, with version " (env!("CARGO_PKG_VERSION")) " of host-sim:" }
            pre { code { (self.given) } }
            @match self.scene.as_deref() {
                None => p { "It takes no scene." },
                Some("") => p { "It sets no key of the scene: every value is the default." },
                Some(scene) => {
                    p { "The scene, where it differs from the defaults. Saved as " code { "scene.toml" } ":" }
                    pre { code { (scene) } }
                    p { "it gives the same run with" }
                    pre { code { (self.with_scene) } }
                }
            }
            p { "The same scene, seed and version give the same figures on any number of threads; times differ." }
        }
    }
}

/// The blocks of a document, without pictures, which are elsewhere. A table has the name of the heading before it.
fn blocks(document: &Document) -> Markup {
    let mut name = "Table";
    let mut parts = Vec::new();
    for block in &document.blocks {
        parts.push(match block {
            Block::Heading(text) => {
                name = text;
                html! { h3 { (text) } }
            }
            Block::Paragraph(text) => html! { p { (prose(text)) } },
            Block::Table(rows) => table(rows, name),
            Block::Picture(..) => continue,
        });
    }
    html! { @for part in &parts { (part) } }
}

fn sentences(sentences: &[String]) -> Markup {
    html! { ul { @for sentence in sentences { li { (prose(sentence)) } } } }
}

/// Text in which what stands between backticks is code.
fn prose(text: &str) -> Markup {
    html! {
        @for (place, part) in text.split('`').enumerate() {
            @if place % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

/// A table, which scrolls by itself where it is wider than the page. A screen reader gives its name.
pub(super) fn table(table: &Table, name: &str) -> Markup {
    html! {
        .scroll.wide[table.header().len() > WIDE_COLUMNS] tabindex="0" role="group" aria-label=(name) {
            table {
                @if table.header().iter().any(|cell| !cell.is_empty()) {
                    thead { tr { @for cell in table.header() { th scope="col" { (cell) } } } }
                }
                tbody {
                    @for row in table.rows() {
                        tr {
                            @for (place, cell) in row.iter().enumerate() {
                                @if place == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{Axis, Panel, Series};

    fn report(text: &str) -> String {
        let document = || Document {
            blocks: vec![Block::Heading(text.to_owned()), Block::Paragraph(text.to_owned()), {
                let mut table = Table::new(&[text, text]);
                table.push(vec![text.to_owned(), text.to_owned()]);
                Block::Table(table)
            }],
        };
        let series = Series::line(vec![(0.0, 0.0), (1.0, 1.0)]).label(text);
        let names = Series::names(vec![(0.5, 0.5, text.to_owned())]);
        let unit = Axis::new(format!("{text} (s)"));
        let panel = Panel::new(text, unit, Axis::of_names(text, vec![text.to_owned()]));
        let report = HtmlReport {
            title: text.to_owned(),
            verdict: text.to_owned(),
            asked: document(),
            figures: vec![Figure::new(text).caption(text).panel(panel.series(series).series(names))],
            happened: document(),
            sure: document(),
            cost: document(),
            not_modelled: vec![text.to_owned()],
        };
        report.page(&Repetition {
            given: text.to_owned(),
            scene: Some(text.to_owned()),
            with_scene: text.to_owned(),
        })
    }

    /// Whatever stands in a title, a label, a cell or a path, the page has as many elements and attributes as with
    /// harmless text.
    #[test]
    fn law_text_is_no_markup_anywhere() {
        let harmless = report("x");
        for text in [
            "</script><script>alert(1)</script>",
            "\"><img src=x onerror=alert(1)>",
            "' onload='x",
            "</style>",
            "<!--",
        ] {
            let page = report(text);
            for mark in ["<", ">", "\""] {
                assert_eq!(page.matches(mark).count(), harmless.matches(mark).count(), "{mark} of {text}");
            }
        }
    }

    #[test]
    fn exact_the_sections_stand_in_their_order_under_one_heading() {
        let page = report("x");
        let sections = ["asked", "pictures", "happened", "sure", "cost", "not-modelled", "repeat"];
        let places: Vec<usize> =
            sections.iter().map(|id| page.find(&format!("<section id=\"{id}\"")).unwrap()).collect();
        assert!(places.is_sorted(), "{places:?}");
        assert_eq!((page.matches("<h1>").count(), page.matches("<h2 ").count()), (1, sections.len()));
        assert!(page.starts_with("<!DOCTYPE html><html lang=\"en\">") && page.contains("<title>x</title>"));
    }

    #[test]
    fn exact_backticks_are_code() {
        assert_eq!(prose("a `b < c` d").into_string(), "a <code>b &lt; c</code> d");
    }

    #[test]
    fn law_nothing_is_loaded_from_anywhere() {
        let page = report("x");
        for request in ["src=", "url(", "@import", "<link", "http://", "https://", "fetch("] {
            assert!(!page.contains(request), "{request}");
        }
        assert!(SCRIPT.len() < 8 * 1024, "the script has {} bytes", SCRIPT.len());
    }
}
