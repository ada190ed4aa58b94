//! Every value of two results beside the key figures: equal to the last bit, or not.
//!
//! A value is named by its path. A row of a list is named by the words in it, so that rows are found again when others
//! come or go.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Map, Value};

/// Fields that hold times of a machine, or what follows from them.
const TIMES: [&str; 9] = [
    "wall_s",
    "ns",
    "cost",
    "ns_per_step",
    "ns_per_ms",
    "times_real_time",
    "cheaper",
    "verdicts",
    "time_s_per_s",
];
/// Words in the name of a row at most.
const WORDS_MAX: usize = 4;
/// Characters of such a word at most.
const CHARACTERS_MAX: usize = 40;

/// A value that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangedValue {
    /// Its path.
    pub name: String,
    /// In the first result.
    pub a: Value,
    /// In the second.
    pub b: Value,
    /// The second less the first per the magnitude of the first; `null` where these are no numbers, or the first is 0.
    pub relative_change: Option<f64>,
}

/// All values beside the key figures.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ComparedValues {
    /// How many are equal to the last bit.
    pub equal: usize,
    /// Those that differ, the largest relative change first.
    pub changed: Vec<ChangedValue>,
    /// Times of a machine, which differ from run to run.
    pub times: Vec<ChangedValue>,
    /// Paths that only one result has, with which.
    pub lone: Vec<String>,
}

impl ComparedValues {
    /// Compares two results.
    pub fn of(a: &Map<String, Value>, b: &Map<String, Value>) -> Self {
        let [of_a, of_b] = [a, b].map(|result| {
            let mut found = BTreeMap::new();
            flatten(&Value::Object(result.clone()), "", &mut found);
            found
        });
        let mut compared = Self::default();
        for (name, in_a) in &of_a {
            let Some(in_b) = of_b.get(name) else {
                compared.lone.push(format!("{name} (only in A)"));
                continue;
            };
            if in_a == in_b {
                compared.equal += 1;
                continue;
            }
            let value = ChangedValue::new(name, in_a, in_b);
            let is_time =
                name.split('.').any(|field| TIMES.contains(&field.split('[').next().unwrap_or(field)));
            if is_time { compared.times.push(value) } else { compared.changed.push(value) }
        }
        let lone = of_b.keys().filter(|name| !of_a.contains_key(*name));
        compared.lone.extend(lone.map(|name| format!("{name} (only in B)")));
        let size = |value: &ChangedValue| value.relative_change.map_or(f64::INFINITY, f64::abs);
        compared.changed.sort_by(|a, b| size(b).total_cmp(&size(a)));
        compared
    }
}

impl ChangedValue {
    fn new(name: &str, a: &Value, b: &Value) -> Self {
        let numbers = a.as_f64().zip(b.as_f64()).filter(|(a, _)| a.abs() > 0.0);
        let relative_change = numbers.map(|(a, b)| (b - a) / a.abs());
        Self { name: name.to_owned(), a: a.clone(), b: b.clone(), relative_change }
    }
}

/// Adds every value below `value` by its path.
fn flatten(value: &Value, path: &str, found: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(fields) => {
            for (name, field) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                flatten(field, &path, found);
            }
        }
        Value::Array(rows) => {
            let mut seen: BTreeMap<String, usize> = BTreeMap::new();
            for row in rows {
                let name = name_of(row);
                let again = seen.entry(name.clone()).or_insert(0);
                *again += 1;
                let number =
                    if *again == 1 && !name.is_empty() { String::new() } else { format!("#{again}") };
                let gap = if name.is_empty() || number.is_empty() { "" } else { " " };
                flatten(row, &format!("{path}[{name}{gap}{number}]"), found);
            }
        }
        other => {
            found.insert(path.to_owned(), other.clone());
        }
    }
}

/// The words of a row, by which it is known.
fn name_of(row: &Value) -> String {
    let Value::Object(fields) = row else { return String::new() };
    let words = fields.values().filter_map(Value::as_str);
    let short = words.filter(|word| word.chars().count() <= CHARACTERS_MAX && !word.is_empty());
    short.take(WORDS_MAX).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(a: &str, b: &str) -> ComparedValues {
        let object = |text: &str| serde_json::from_str::<Map<String, Value>>(text).unwrap();
        ComparedValues::of(&object(a), &object(b))
    }

    #[test]
    fn exact_rows_are_found_by_their_words() {
        let found = compared(
            "{\"rows\":[{\"filter\":\"twin\",\"rms\":2.0},{\"filter\":\"best\",\"rms\":3.0}],\"list\":[1,2]}",
            "{\"rows\":[{\"filter\":\"best\",\"rms\":3.0},{\"filter\":\"twin\",\"rms\":2.5}],\"list\":[1,3]}",
        );
        let names: Vec<&str> = found.changed.iter().map(|value| value.name.as_str()).collect();
        assert_eq!(names, ["list[#2]", "rows[twin].rms"]);
        assert_eq!(found.changed[1].relative_change, Some(0.25));
        assert_eq!(found.equal, 4);
    }

    #[test]
    fn exact_times_are_apart_and_lone_values_are_named() {
        let found = compared(
            "{\"cost\":[{\"ns_per_step\":1}],\"wall_s\":2,\"ok\":true,\"gone\":1}",
            "{\"cost\":[{\"ns_per_step\":2}],\"wall_s\":3,\"ok\":false,\"come\":1}",
        );
        assert_eq!((found.times.len(), found.changed.len()), (2, 1));
        assert_eq!(found.lone, ["gone (only in A)", "come (only in B)"]);
        assert_eq!(found.changed[0].relative_change, None);
    }
}
