//! A page of results that a command writes whole: prose with named places, and the values that stand in them.
//!
//! A template is Markdown in which `{name}` is a place. Times on one machine differ from run to run: in a value such a
//! figure has a tilde before it (`~12.5`), and a paragraph of them begins with [`ON_ONE_MACHINE`]. A comparison of two
//! pages leaves both out.

use textwrap::{Options, WordSplitter};

use super::OutputError;

/// Name of a place, and the text that stands in it.
pub type PlacedValue = (&'static str, String);

/// Longest line of a page.
const LINE_WIDTH: usize = 118;

/// How a paragraph begins that holds nothing but times on one machine.
pub const ON_ONE_MACHINE: &str = "On one machine:";

/// `template` with a value in each of its places, its paragraphs wrapped.
///
/// # Errors
/// When a place has no value, or a value no place.
pub fn filled(template: &str, values: &[PlacedValue]) -> Result<String, OutputError> {
    let mut text = template.to_owned();
    for (name, value) in values {
        let place = format!("{{{name}}}");
        if !text.contains(&place) {
            return Err(OutputError::Page(format!("has no place {place}")));
        }
        text = text.replace(&place, value.trim_end());
    }
    if let Some(place) = first_place(&text) {
        return Err(OutputError::Page(format!("has no value for {place}")));
    }
    let blocks: Vec<String> = blocks(&text).iter().map(|block| wrapped(block)).collect();
    Ok(blocks.join("\n\n") + "\n")
}

/// The first place that is left: a name of small letters, digits and underscores in braces.
fn first_place(text: &str) -> Option<String> {
    text.split('{').skip(1).find_map(|rest| {
        let (name, _) = rest.split_once('}')?;
        let is_name = !name.is_empty()
            && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        is_name.then(|| format!("{{{name}}}"))
    })
}

/// The parts of a page that blank lines separate; a fenced block is one part.
fn blocks(text: &str) -> Vec<String> {
    let mut blocks = vec![Vec::new()];
    let mut fenced = false;
    for line in text.lines() {
        fenced ^= line.starts_with("```");
        if line.is_empty() && !fenced {
            blocks.push(Vec::new());
        } else if let Some(block) = blocks.last_mut() {
            block.push(line);
        }
    }
    blocks.into_iter().filter(|block| !block.is_empty()).map(|block| block.join("\n")).collect()
}

/// Prose and lists in lines of at most [`LINE_WIDTH`]; headings, tables, pictures and fenced blocks as they are.
fn wrapped(block: &str) -> String {
    if ["#", "|", "```", "<", "!["].iter().any(|start| block.starts_with(start)) {
        return block.to_owned();
    }
    items(block).iter().map(|item| wrapped_item(item)).collect::<Vec<_>>().join("\n")
}

/// The items of a list, each on one line; a paragraph is one item.
fn items(block: &str) -> Vec<String> {
    let mut items: Vec<String> = Vec::new();
    for line in block.lines() {
        match items.last_mut() {
            Some(item) if marker(line).is_none() => {
                item.push(' ');
                item.push_str(line.trim());
            }
            _ => items.push(line.trim_end().to_owned()),
        }
    }
    items
}

/// The mark of a list's item, `- ` or `1. `.
fn marker(line: &str) -> Option<&str> {
    let digits = line.bytes().take_while(u8::is_ascii_digit).count();
    match (line.starts_with("- "), digits) {
        (true, _) => line.get(..2),
        (false, 1..) if line.get(digits..)?.starts_with(". ") => line.get(..digits + 2),
        _ => None,
    }
}

fn wrapped_item(item: &str) -> String {
    let indent = " ".repeat(marker(item).map_or(0, str::len));
    let options =
        Options::new(LINE_WIDTH).subsequent_indent(&indent).word_splitter(WordSplitter::NoHyphenation);
    textwrap::fill(item, options)
}

/// The first line of `written` where it differs from `fresh` in more than times on one machine and white space; from 1.
pub fn first_difference(written: &str, fresh: &str) -> Option<usize> {
    let (written, fresh) = (lasting(written), lasting(fresh));
    let differs = written.iter().zip(&fresh).position(|((_, a), (_, b))| a != b);
    match differs {
        Some(index) => Some(written[index].0),
        None if written.len() == fresh.len() => None,
        None => Some(written.get(fresh.len()).or(written.last()).map_or(1, |(line, _)| *line)),
    }
}

/// The words of a page with the line each stands on, without what differs from machine to machine.
fn lasting(page: &str) -> Vec<(usize, String)> {
    let mut words = Vec::new();
    let mut timed = false;
    for (index, line) in page.lines().enumerate() {
        timed = !line.is_empty() && (timed || line.starts_with(ON_ONE_MACHINE));
        if !timed {
            words.extend(line.split_whitespace().map(|word| (index + 1, lasting_word(word))));
        }
    }
    words
}

/// A word; only its sign where it is a time, and one dash for a rule of any length.
fn lasting_word(word: &str) -> String {
    let rule = word.chars().all(|c| c == '-');
    match (rule, word.contains('~')) {
        (true, _) => "-".to_owned(),
        (_, true) => "~".to_owned(),
        _ => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_every_place_is_filled_and_prose_is_wrapped() {
        let prose = "# A page\n\nIt is {a} and {b}.\n\n{table}\n\n- an item of\n  {a}\n";
        let template = format!("{prose}\n```sh\nrun {{not a place}}\n```\n");
        let long = "word ".repeat(40);
        let values =
            [("a", long.clone()), ("b", "2".to_owned()), ("table", "| x |\n| - |\n| 1 |\n".to_owned())];
        let page = filled(&template, &values).unwrap();
        assert!(page.lines().all(|line| line.chars().count() <= LINE_WIDTH), "{page}");
        assert_eq!(page.matches("word").count(), 80);
        assert!(page.contains("| x |\n| - |\n| 1 |\n"));
        assert!(page.contains("\n  word"), "further lines of an item are indented: {page}");
        assert!(page.contains("run {not a place}"));
    }

    #[test]
    fn exact_a_place_without_value_and_a_value_without_place_are_refused() {
        let refused = |template, values: &[PlacedValue]| filled(template, values).unwrap_err().to_string();
        assert!(refused("{a} {b}", &[("a", String::new())]).contains("{b}"));
        assert!(refused("text", &[("a", String::new())]).contains("{a}"));
    }

    #[test]
    fn exact_times_and_white_space_are_no_difference_and_all_else_is() {
        let written =
            "The rate is 3.\n\n| ns  |\n| --- |\n| ~12 |\n\nOn one machine: 3 of 4\nand 5.\n\nEnd.\n";
        let fresh = "The rate\nis 3.\n\n| ns    |\n| ----- |\n| ~12.5 |\n\nOn one machine: 2 of 4.\n\nEnd.\n";
        assert_eq!(first_difference(written, fresh), None);
        assert_eq!(first_difference(written, &fresh.replace("is 3.", "is 4.")), Some(1));
        assert_eq!(first_difference(written, &fresh.replace("End.", "End. More.")), Some(10));
        assert_eq!(first_difference(written, &fresh.replace("~12.5", "12.5")), Some(5));
    }
}
