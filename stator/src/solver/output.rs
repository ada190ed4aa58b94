//! The `.dat` file of CalculiX: displacements after cooling, volumes, frequencies and shapes, each number checked.

use std::collections::HashMap;

/// What was read of an output.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Displacement of each probe after cooling, mm, in the order of the probes.
    pub cooled: Vec<[f64; 3]>,
    /// Volume of the foil and of the silicon, mm3.
    pub volumes: [f64; 2],
    /// Modes, frequencies rising; rigid motions among them.
    pub modes: Vec<OutputMode>,
}

/// A mode.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputMode {
    /// Square of the angular frequency, 1/s2; about 0, of either sign, for a rigid motion.
    pub eigenvalue: f64,
    /// Shape at each probe for a modal mass of one tonne, 1/sqrt(t), in the order of the probes.
    pub shape: Vec<[f64; 3]>,
}

/// Why an output is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OutputFault {
    /// A line that should hold numbers does not.
    #[error("line {line}: {what}")]
    Line {
        /// Which line, from 1.
        line: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// A part is not there, or there are too many of it.
    #[error("{0}")]
    Part(&'static str),
}

/// Largest displacement after cooling, mm, and largest number of a shape: far beyond any that means something.
const COOLED_MAX: f64 = 1e3;
const SHAPE_MAX: f64 = 1e9;

type Lines<'a> = std::iter::Peekable<std::iter::Enumerate<std::str::Lines<'a>>>;

/// Reads an output that is to have displacements of the nodes `probes`, numbered from 0.
///
/// # Errors
/// What is missing, comes twice, is no number or cannot be one.
pub fn read(text: &str, probes: &[usize]) -> Result<Output, OutputFault> {
    let places: HashMap<usize, usize> =
        probes.iter().enumerate().map(|(place, number)| (*number + 1, place)).collect();
    if places.len() != probes.len() {
        return Err(OutputFault::Part("a probe is asked for twice"));
    }
    let mut lines: Lines<'_> = text.lines().enumerate().peekable();
    let (mut cooled, mut eigenvalues, mut shapes) = (None, Vec::new(), Vec::new());
    let mut volumes = [None; 2];
    while let Some((_, line)) = lines.next() {
        let words = line.split_whitespace();
        if line.contains("displacements") {
            let table = displacements(&mut lines, &places)?;
            if eigenvalues.is_empty() {
                cooled = Some(table);
            } else if shapes.len() < eigenvalues.len() {
                shapes.push(table);
            } else {
                return Err(OutputFault::Part("more shapes than frequencies"));
            }
        } else if line.contains("total volume for set") {
            let which = match words.clone().nth(4) {
                Some("FOIL") => 0,
                Some("SILICON") => 1,
                _ => continue,
            };
            volumes[which] = Some(single(&mut lines)?);
        } else if words.clone().eq("E I G E N V A L U E O U T P U T".split(' ')) {
            if !eigenvalues.is_empty() {
                return Err(OutputFault::Part("frequencies come twice"));
            }
            eigenvalues = frequencies(&mut lines)?;
        }
    }
    let cooled = cooled.ok_or(OutputFault::Part("no displacements after cooling"))?;
    if cooled.iter().flatten().any(|value| value.abs() > COOLED_MAX) {
        return Err(OutputFault::Part("a displacement after cooling is absurd"));
    }
    let [Some(foil), Some(silicon)] = volumes else {
        return Err(OutputFault::Part("no volumes"));
    };
    if eigenvalues.is_empty() || shapes.len() != eigenvalues.len() {
        return Err(OutputFault::Part("not as many shapes as frequencies"));
    }
    if shapes.iter().flatten().flatten().any(|value| value.abs() > SHAPE_MAX) {
        return Err(OutputFault::Part("a shape is absurd"));
    }
    let modes =
        eigenvalues.into_iter().zip(shapes).map(|(eigenvalue, shape)| OutputMode { eigenvalue, shape });
    Ok(Output { cooled, volumes: [foil, silicon], modes: modes.collect() })
}

/// A finite number.
fn number(word: &str, line: usize) -> Result<f64, OutputFault> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(OutputFault::Line { line: line + 1, what: "no number where there should be one" }),
    }
}

fn skip_empty(lines: &mut Lines<'_>) {
    while lines.next_if(|(_, line)| line.trim().is_empty()).is_some() {}
}

/// A table `node x y z` that ends with an empty line, by the places of the nodes.
fn displacements(
    lines: &mut Lines<'_>,
    places: &HashMap<usize, usize>,
) -> Result<Vec<[f64; 3]>, OutputFault> {
    skip_empty(lines);
    let mut table = vec![None; places.len()];
    while let Some((at, line)) = lines.next_if(|(_, line)| !line.trim().is_empty()) {
        let fault = |what| OutputFault::Line { line: at + 1, what };
        let mut words = line.split_whitespace();
        let node = words.next().and_then(|word| word.parse().ok()).ok_or(fault("no node's number"))?;
        let place = *places.get(&node).ok_or(fault("a node that was not asked for"))?;
        let mut next = || words.next().ok_or(fault("fewer than three displacements"));
        let row = [number(next()?, at)?, number(next()?, at)?, number(next()?, at)?];
        if table[place].replace(row).is_some() {
            return Err(fault("a node comes twice"));
        }
    }
    table
        .into_iter()
        .collect::<Option<Vec<_>>>()
        .ok_or(OutputFault::Part("displacements of a node are missing"))
}

/// The first number of the next line that is not empty, above 0.
fn single(lines: &mut Lines<'_>) -> Result<f64, OutputFault> {
    skip_empty(lines);
    let (at, line) = lines.next().ok_or(OutputFault::Part("ends too early"))?;
    let value = number(line.trim(), at)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(OutputFault::Line { line: at + 1, what: "a volume that is not above 0" })
    }
}

/// The second column of the table of eigenvalues: their numbers count from 1, and they rise.
fn frequencies(lines: &mut Lines<'_>) -> Result<Vec<f64>, OutputFault> {
    let mut eigenvalues: Vec<f64> = Vec::new();
    // A heading, then rows; the table ends with an empty line.
    while lines.next_if(|(_, line)| line.split_whitespace().next() != Some("1")).is_some() {}
    while let Some((at, line)) = lines.next_if(|(_, line)| !line.trim().is_empty()) {
        let fault = |what| OutputFault::Line { line: at + 1, what };
        let mut words = line.split_whitespace();
        if words.next() != Some(&*(eigenvalues.len() + 1).to_string()) {
            return Err(fault("a mode out of its turn"));
        }
        let eigenvalue = number(words.next().ok_or(fault("no eigenvalue"))?, at)?;
        if eigenvalues.last().is_some_and(|last| eigenvalue < *last) {
            return Err(fault("eigenvalues that do not rise"));
        }
        eigenvalues.push(eigenvalue);
    }
    Ok(eigenvalues)
}

#[cfg(test)]
mod tests;
