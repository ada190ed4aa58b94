//! A figure of merit: a number in the JSON of a result, named by its path.
//!
//! A path is the names of fields with dots between them: `stated.beyond_3_sigma`. In a list it is the place, from 0, or
//! what the element has, in brackets: `rows.[filter=twin,drive=b,phase=steady].rms_angle_mdeg`.

use serde_json::Value;

use super::SweepError;

/// Fields that measure this machine.
const MACHINE_TIMES: [&str; 2] = ["wall_s", "time_s_per_s"];

/// Paths that a refusal lists.
const LISTED_MAX: usize = 8;

/// What stands at a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    /// A number; of yes or no 1 or 0.
    Number(f64),
    /// `null`: the run has none.
    Empty,
    /// Nothing, or no number.
    Nothing,
}

/// The parts of a path: dots within brackets part nothing.
fn parts(path: &str) -> Vec<&str> {
    let mut depth = 0_i32;
    let mut parts: Vec<&str> = path
        .split(|c: char| {
            depth += i32::from(c == '[') - i32::from(c == ']');
            c == '.' && depth == 0
        })
        .collect();
    parts.retain(|part| !part.is_empty());
    parts
}

/// The element of a list that `part` names.
fn element<'a>(list: &'a [Value], part: &str) -> Option<&'a Value> {
    let Some(conditions) = part.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) else {
        return list.get(part.parse::<usize>().ok()?);
    };
    let holds = |value: &Value, condition: &str| {
        condition.split_once('=').is_some_and(|(field, wanted)| match &value[field.trim()] {
            Value::String(text) => text == wanted.trim(),
            other => serde_json::from_str::<Value>(wanted.trim()).is_ok_and(|wanted| wanted == *other),
        })
    };
    list.iter().find(|value| conditions.split(',').all(|condition| holds(value, condition)))
}

/// What stands at `path` in `result`.
pub(super) fn find(result: &Value, path: &str) -> Found {
    let found = parts(path).into_iter().try_fold(result, |value, part| match value {
        Value::Array(list) => element(list, part),
        Value::Object(fields) => fields.get(part),
        _ => None,
    });
    match found {
        Some(Value::Number(number)) => number.as_f64().map_or(Found::Nothing, Found::Number),
        Some(Value::Bool(yes)) => Found::Number(f64::from(u8::from(*yes))),
        Some(Value::Null) => Found::Empty,
        _ => Found::Nothing,
    }
}

/// Refuses a path that names a time of this machine.
pub(super) fn admit(path: &str) -> Result<(), SweepError> {
    let measures_machine = parts(path).last().is_some_and(|last| MACHINE_TIMES.contains(last));
    if measures_machine { Err(SweepError::MachineTime { path: path.to_owned() }) } else { Ok(()) }
}

/// Every path of a number in `value`.
fn paths(value: &Value, before: &str, into: &mut Vec<String>) {
    let below = |part: &str| if before.is_empty() { part.to_owned() } else { format!("{before}.{part}") };
    match value {
        Value::Object(fields) => {
            let admitted = fields.iter().filter(|(name, _)| !MACHINE_TIMES.contains(&name.as_str()));
            admitted.for_each(|(name, value)| paths(value, &below(name), into));
        }
        Value::Array(list) => {
            for (place, value) in list.iter().enumerate() {
                paths(value, &below(&selector(list, place)), into);
            }
        }
        Value::Number(_) | Value::Bool(_) | Value::Null => into.push(before.to_owned()),
        Value::String(_) => {}
    }
}

/// How a path names an element of a list: by its words, if no other has the same, by its place otherwise.
fn selector(list: &[Value], place: usize) -> String {
    let words = |value: &Value| -> Vec<String> {
        let fields = value.as_object().into_iter().flatten();
        fields.filter_map(|(name, value)| Some(format!("{name}={}", value.as_str()?))).collect()
    };
    let own = words(&list[place]);
    let is_its_own = !own.is_empty() && list.iter().filter(|other| words(other) == own).count() == 1;
    if is_its_own { format!("[{}]", own.join(",")) } else { place.to_string() }
}

/// The error of a path at which `result` has no number, with those that look like it.
pub(super) fn missing(command: &'static str, result: &Value, path: &str) -> SweepError {
    let mut known = all_paths(result);
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let alike = |known: &String| {
        let whole = strsim::normalized_damerau_levenshtein(path, known);
        whole.max(0.99 * strsim::normalized_damerau_levenshtein(&last(path), &last(known)))
    };
    known.sort_by(|a, b| alike(b).total_cmp(&alike(a)));
    SweepError::NoFigure { command, path: path.to_owned(), nearest: some(known) }
}

/// The error of a sweep without figures, with those that there are.
pub(super) fn unnamed(result: &Value) -> SweepError {
    SweepError::Unnamed { some: some(all_paths(result)) }
}

fn all_paths(result: &Value) -> Vec<String> {
    let mut known = Vec::new();
    paths(result, "", &mut known);
    known
}

/// The first few.
fn some(mut known: Vec<String>) -> Vec<String> {
    if known.len() > LISTED_MAX {
        known.truncate(LISTED_MAX);
        known.push("...".to_owned());
    }
    known
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn exact_paths_lead_through_fields_and_lists() {
        let result = json!({
            "a": {"b": 2.5, "word": "x"}, "yes": true, "none": null, "list": [1, 2],
            "rows": [{"of": "p", "n": 1, "v": 7.0}, {"of": "q.r", "n": 2, "v": 8.0}],
        });
        for (path, found) in [
            ("a.b", Found::Number(2.5)),
            ("yes", Found::Number(1.0)),
            ("none", Found::Empty),
            ("list.1", Found::Number(2.0)),
            ("rows.[of=p].v", Found::Number(7.0)),
            ("rows.[of=q.r,n=2].v", Found::Number(8.0)),
            ("rows.[of=p,n=2].v", Found::Nothing),
            ("a.word", Found::Nothing),
            ("a", Found::Nothing),
            ("list.7", Found::Nothing),
            ("b", Found::Nothing),
        ] {
            assert_eq!(find(&result, path), found, "{path}");
        }
        let error = missing("position", &result, "rows.[of=p].w");
        let hint = error.hint().unwrap();
        assert!(hint.starts_with("it has rows.[of=p]."), "{hint}");
        assert_eq!(error.to_string(), "the result of position has no figure rows.[of=p].w");
        assert!(find(&json!([{"f": 3}]), "[f=3].f") == Found::Number(3.0));
        assert!(matches!(admit("rows.0.wall_s"), Err(SweepError::MachineTime { .. })));
    }
}
