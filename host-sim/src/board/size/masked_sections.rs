//! For how long a program masks interrupts while its ticks run: the longest way from `cpsid i` to the instruction that
//! unmasks them, in instructions.
//!
//! ```text
//! 1011 0110 0111 0010                       cpsid i          masks
//! 1011 0110 0110 0010                       cpsie i          unmasks
//! 1011 0110 0111 0001, 1011 0110 0110 0001  cpsid f, cpsie f likewise, faults as well
//! 11110 01110 0 0 Rn | 10 0 0 1000 00010000 msr primask, Rn  as before the `cpsid i` whose end it is
//! ```
//!
//! (Armv7-M Architecture Reference Manual, B5.2.) Looked at are the loop of the main function and all that it calls.
//! What comes before the loop is not: no timer runs. Nor is the timer's interrupt, which no other one interrupts, nor a
//! section that never ends: the program does.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::reachable_calls::{Branch, branches_at, holding, instructions, narrow, wide};
use crate::board::BoardError;
use crate::board::elf_image::{ElfImage, Function};

/// The main function.
const MAIN: &str = "__cortex_m_rt_main";

/// Parts of the names of functions that end the program.
const ENDS: [&str; 4] = ["panicking", "rust_begin_unwind", "expect_failed", "unwrap_failed"];

/// A section of a program in which interrupts are masked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaskedSection {
    /// The function that masks them.
    pub function: String,
    /// The address of its `cpsid i`.
    pub address: u32,
    /// Instructions on the longest way after it, the one that unmasks them included; `None` where the section has a
    /// loop, a call, a jump by address or a return, whose instructions are not counted.
    pub instructions: Option<usize>,
}

/// What an instruction does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Plain,
    Mask,
    /// Unmasks, or restores the mask of before the section.
    Restore,
    Unmask,
    Jump(u32),
    Branch(u32),
    /// A call, which comes back.
    Call,
    /// A return, or a jump by address.
    Leave,
    /// The end of the program.
    End,
}

/// The instructions of a function, by their addresses, each with the address after it.
type Steps = BTreeMap<u32, (Step, u32)>;

/// The sections of the program `elf`.
///
/// # Errors
/// When it cannot be read, or has no main function.
pub fn masked_sections(elf: &Path) -> Result<Vec<MaskedSection>, BoardError> {
    sections(&ElfImage::read(elf)?)
}

fn sections(image: &ElfImage) -> Result<Vec<MaskedSection>, BoardError> {
    let by_address: BTreeMap<u32, &Function> =
        image.functions.iter().map(|function| (function.address, function)).collect();
    let is_main = |function: &&Function| function.name.contains(MAIN);
    let main = image.functions.iter().find(is_main).ok_or(BoardError::NoTask { task: MAIN })?;
    let ends = |address: u32| {
        let callee = holding(&by_address, address);
        callee.is_some_and(|callee| ENDS.iter().any(|end| callee.name.contains(end)))
    };
    let steps_of = |function: &Function| steps(function, &image.code_from, ends);
    let of_main = steps_of(main);
    let mut from_start = after(&of_main, main.address);
    from_start.insert(main.address);
    // What only a jump by address leads to may be in the loop.
    let in_loop = |at: &u32| !from_start.contains(at) || after(&of_main, *at).contains(at);
    let masks = of_main.iter().filter(|(_, (step, _))| *step == Step::Mask).map(|(at, _)| at);
    let mut found: Vec<_> =
        masks.filter(|at| in_loop(at)).filter_map(|at| section(main, &of_main, *at)).collect();

    let called = |(_, branch): &(u32, Branch)| match *branch {
        Branch::To(address) if !ends(address) => holding(&by_address, address),
        _ => None,
    };
    let branches = branches_at(main, &image.code_from);
    let of_loop = branches.iter().filter(|(at, _)| in_loop(at));
    let mut to_follow: Vec<&Function> = of_loop.filter_map(called).collect();
    let mut seen = BTreeSet::from([main.address]);
    while let Some(function) = to_follow.pop() {
        if seen.insert(function.address) {
            let steps = steps_of(function);
            let masks = steps.iter().filter(|(_, (step, _))| *step == Step::Mask);
            found.extend(masks.filter_map(|(at, _)| section(function, &steps, *at)));
            to_follow.extend(branches_at(function, &image.code_from).iter().filter_map(called));
        }
    }
    Ok(found)
}

/// The section that begins at `address`; `None` for one that never ends.
fn section(function: &Function, steps: &Steps, address: u32) -> Option<MaskedSection> {
    let mut ways = Ways { steps, known: BTreeMap::new() };
    let instructions = match ways.longest(address, 0) {
        Way::Never | Way::Round => return None,
        // Its own instruction masks nothing yet.
        Way::After(instructions) => Some(instructions - 1),
        Way::Unknown => None,
    };
    Some(MaskedSection { function: function.name.clone(), address, instructions })
}

/// The addresses that can be executed after the instruction at `from`.
fn after(steps: &Steps, from: u32) -> BTreeSet<u32> {
    let mut seen = BTreeSet::new();
    let mut to_follow = vec![from];
    while let Some(at) = to_follow.pop() {
        to_follow.extend(followers(steps, at).into_iter().flatten().filter(|next| seen.insert(*next)));
    }
    seen
}

/// Where the program goes on after the instruction at `at`, within the function; a call comes back.
fn followers(steps: &Steps, at: u32) -> [Option<u32>; 2] {
    match steps.get(&at) {
        Some((Step::Jump(to), _)) => [Some(*to), None],
        Some((Step::Branch(to), next)) => [Some(*to), Some(*next)],
        Some((Step::Leave | Step::End, _)) | None => [None, None],
        Some((_, next)) => [Some(*next), None],
    }
}

/// How far it is to the end of the section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// It never ends.
    Never,
    /// Back to where it came from.
    Round,
    After(usize),
    Unknown,
}

impl Way {
    /// The longer one of two branches. A round from which a way out leads is one of any length.
    fn or(self, other: Self) -> Self {
        match (self, other) {
            (Self::Never, way) | (way, Self::Never) => way,
            (Self::Round, Self::Round) => Self::Round,
            (Self::After(one), Self::After(two)) => Self::After(one.max(two)),
            _ => Self::Unknown,
        }
    }
}

/// The longest ways to the end of a section.
struct Ways<'a> {
    steps: &'a Steps,
    /// By address and by the sections that have begun; a round while it is looked at.
    known: BTreeMap<(u32, usize), Way>,
}

impl Ways<'_> {
    /// From the instruction at `at` on, in which `begun` sections are under way.
    fn longest(&mut self, at: u32, begun: usize) -> Way {
        if let Some(way) = self.known.get(&(at, begun)) {
            return *way;
        }
        self.known.insert((at, begun), Way::Round);
        let way = self.look(at, begun);
        self.known.insert((at, begun), way);
        way
    }

    fn look(&mut self, at: u32, begun: usize) -> Way {
        let Some(&(step, _)) = self.steps.get(&at) else { return Way::Unknown };
        let begun = match step {
            Step::Mask => begun + 1,
            Step::Restore => begun - 1,
            Step::Unmask => 0,
            Step::Call | Step::Leave => return Way::Unknown,
            _ => begun,
        };
        if begun == 0 {
            return Way::After(1);
        }
        let next = followers(self.steps, at).into_iter().flatten();
        match next.fold(Way::Never, |way, next| way.or(self.longest(next, begun))) {
            Way::After(instructions) => Way::After(instructions + 1),
            way => way,
        }
    }
}

/// The instructions of `function`. What is at an address that `ends` the program does not come back.
fn steps(function: &Function, code_from: &[(u32, bool)], ends: impl Fn(u32) -> bool) -> Steps {
    let mut steps = Steps::new();
    // Instructions that are still to be executed on a condition.
    let mut conditional = 0;
    for (at, first, second) in instructions(function, code_from) {
        let next = at + if second.is_some() { 4 } else { 2 };
        let step = match second {
            Some(second) => wide_step(at, first, second, &ends),
            None => narrow_step(at, first),
        };
        let step = match step {
            Step::Jump(to) if conditional > 0 => Step::Branch(to),
            // It is left on a condition, and goes on to the next one without.
            Step::Leave if conditional > 0 => Step::Call,
            step => step,
        };
        conditional = match first {
            // The lowest bit that is set ends the mask of one to four instructions.
            0xbf01..=0xbfff if second.is_none() && first & 0xf > 0 => 4 - (first & 0xf).trailing_zeros(),
            _ => conditional.saturating_sub(1),
        };
        steps.insert(at, (step, next));
    }
    steps
}

fn narrow_step(at: u32, code: u32) -> Step {
    match (code, narrow(at, code)) {
        (0xb671 | 0xb672, _) => Step::Mask,
        (0xb661 | 0xb662, _) => Step::Unmask,
        // UDF.
        (0xde00..=0xdeff, _) => Step::End,
        (0xe000..=0xe7ff, Some(Branch::To(to))) => Step::Jump(to),
        (_, Some(Branch::To(to))) => Step::Branch(to),
        _ if code & 0xff87 == 0x4780 => Step::Call,
        // Jumps by address, returns, and a number that goes into the program counter.
        (0x4700..=0x47ff | 0xbd00..=0xbdff, _) | (_, Some(Branch::ByAddress)) => Step::Leave,
        _ if code & 0xff87 == 0x4687 => Step::Leave,
        // CBZ, CBNZ: 1011 x0 i 1 imm5 Rn.
        _ if code & 0xf500 == 0xb100 => {
            Step::Branch(at + 4 + ((code >> 9 & 1) << 6 | (code >> 3 & 0x1f) << 1))
        }
        _ => Step::Plain,
    }
}

fn wide_step(at: u32, first: u32, second: u32, ends: impl Fn(u32) -> bool) -> Step {
    match (second & 0xd000, wide(at, first, second)) {
        _ if first & 0xfff0 == 0xf380 && second == 0x8810 => Step::Restore,
        (0x8000, Some(Branch::To(to))) => Step::Branch(to),
        (0x9000, Some(Branch::To(to))) => Step::Jump(to),
        (_, Some(Branch::To(to))) if ends(to) => Step::End,
        (_, Some(_)) => Step::Call,
        // Tables of branches, and loads of the program counter.
        _ if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 => Step::Leave,
        _ if first & 0xffd0 == 0xe890 && second >> 15 == 1 => Step::Leave,
        _ if first & 0xff70 == 0xf850 && second >> 12 == 0xf => Step::Leave,
        _ => Step::Plain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASK: u16 = 0xb672;
    const UNMASK: u16 = 0xb662;
    const NOP: u16 = 0xbf00;
    const RETURN: u16 = 0x4770;
    /// `mrs r0, primask` and `msr primask, r0`.
    const SAVE: [u16; 2] = [0xf3ef, 0x8010];
    const RESTORE: [u16; 2] = [0xf380, 0x8810];
    const FOREVER: u16 = 0xe7fe;

    fn function(name: &str, address: u32, halves: &[u16]) -> Function {
        let bytes = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        Function { name: name.to_owned(), address, bytes }
    }

    /// The sections of a program whose loop calls a function made of `halves`.
    fn of_called(halves: &[u16]) -> Vec<Option<usize>> {
        // bl to 0x1100, and back.
        let functions =
            vec![function(MAIN, 0x1000, &[0xf000, 0xf87e, 0xe7fc]), function("called", 0x1100, halves)];
        let found = sections(&ElfImage::of(functions, vec![])).unwrap();
        found.into_iter().map(|section| section.instructions).collect()
    }

    /// Encodings as an assembler gives them (`llvm-mc -triple=thumbv7em -show-encoding`).
    #[test]
    fn exact_the_longest_way_is_counted() {
        assert_eq!(of_called(&[RETURN]), []);
        assert_eq!(of_called(&[MASK, NOP, UNMASK, RETURN]), [Some(2)]);
        // A section within a section ends with the outer one.
        let nested =
            [&SAVE[..], &[MASK], &SAVE, &[MASK, NOP], &RESTORE, &[NOP], &RESTORE, &[RETURN]].concat();
        assert_eq!(of_called(&nested), [Some(6), Some(2)]);
        // cbz r0 over two instructions; then the longer way is without the branch. beq does the same.
        for over in [0xb108, 0xd001] {
            assert_eq!(of_called(&[MASK, over, NOP, NOP, UNMASK, RETURN]), [Some(4)], "{over:x}");
        }
        // b over three instructions.
        assert_eq!(of_called(&[MASK, 0xe002, NOP, NOP, NOP, UNMASK, RETURN]), [Some(2)]);
    }

    /// A loop, a call, a return and a jump by address have a length that is not known; a section that never ends has
    /// none.
    #[test]
    fn exact_what_is_not_counted_is_told() {
        for halves in [
            &[MASK, NOP, 0xd1fd, UNMASK, RETURN][..],
            &[MASK, 0xf000, 0xf87e, UNMASK, RETURN],
            &[MASK, RETURN],
            &[MASK, 0x4718],
        ] {
            assert_eq!(of_called(halves), [None], "{halves:x?}");
        }
        assert_eq!(of_called(&[MASK, NOP, FOREVER]), []);
    }

    /// Of the main function only its loop counts, and what the loop calls, but for what ends the program.
    #[test]
    fn exact_what_is_before_the_loop_is_not_counted() {
        let masks = [MASK, NOP, NOP, UNMASK];
        // bl to 0x1100, bl to 0x1200 unless beq leads over it, and back to the second section.
        let main = [&masks[..], &[MASK, UNMASK, 0xf000, 0xf878, 0xd001, 0xf000, 0xf8f5, 0xe7f7]].concat();
        let functions = vec![
            function(MAIN, 0x1000, &main),
            function("called", 0x1100, &[MASK, NOP, UNMASK, RETURN]),
            function("core::panicking::panic", 0x1200, &[MASK, NOP, NOP, NOP, UNMASK, FOREVER]),
        ];
        let found = sections(&ElfImage::of(functions, vec![])).unwrap();
        let found: Vec<(u32, Option<usize>)> =
            found.into_iter().map(|section| (section.address, section.instructions)).collect();
        assert_eq!(found, [(0x1008, Some(1)), (0x1100, Some(2))]);
        // tbb: a table of branches.
        let by_table = function(MAIN, 0x1000, &[0xe8df, 0xf000, MASK, NOP, UNMASK, FOREVER]);
        let found = sections(&ElfImage::of(vec![by_table], vec![])).unwrap();
        assert_eq!(found.iter().map(|section| section.instructions).collect::<Vec<_>>(), [Some(2)]);
        assert!(matches!(sections(&ElfImage::of(vec![], vec![])), Err(BoardError::NoTask { task: MAIN })));
    }
}
