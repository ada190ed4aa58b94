//! Which functions the tasks can reach: by every branch from their code that leads out of its own function, and by the
//! branches of the functions reached.
//!
//! ```text
//! 11110 S imm10 | 11 J1 1 J2 imm11      BL     I = not (J xor S),  offset = S I1 I2 imm10 imm11 0
//! 11110 S imm10 | 10 J1 1 J2 imm11      B.W    the same
//! 11110 S cond imm6 | 10 J1 0 J2 imm11  B.W if,  offset = S J2 J1 imm6 imm11 0
//! 11100 imm11, 1101 cond imm8           B, B if
//! 010001111 Rm 000                      BLX by address: the target is not in the code
//! ```
//!
//! (Armv7-M Architecture Reference Manual, A7.7.) A branch by address cannot be followed, and is therefore forbidden.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::Serialize;

use crate::board::BoardError;
use crate::board::elf_image::{ElfImage, Function};

/// Parts of the demangled names of the functions in which the tasks begin. The first must be in every program.
const ROOTS: [&str; 3] =
    ["firmware::application::Application<D>::tick", "SysTick", "firmware::telemetry::log::log"];

/// Calls that are in the code and never happen: the beginning of the callee's name, and why.
pub(crate) const EXCUSED: [(&str, &str); 1] = [(
    "core::panicking::panic_const::panic_const_rem_by_zero",
    "the queue of `heapless` divides by its capacity, a constant above 0 that the compiler does not see there",
)];

/// A call that the tasks must not make.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ForbiddenCall {
    /// The function that calls.
    pub caller: String,
    /// The function that is called.
    pub callee: String,
    /// Why it is forbidden.
    pub reason: &'static str,
}

impl fmt::Display for ForbiddenCall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { caller, callee, reason } = self;
        write!(f, "{caller} calls {callee}: {reason}")
    }
}

/// The functions that the tasks can reach.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReachableCalls {
    /// Number of functions.
    pub functions: usize,
    /// Forbidden calls among them.
    pub forbidden: Vec<ForbiddenCall>,
}

/// A branch out of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Branch {
    To(u32),
    ByAddress,
}

fn is_excused(name: &str) -> bool {
    EXCUSED.iter().any(|(excused, _)| name.starts_with(excused))
}

/// Why a function of this name may not be called from the tasks.
fn reason(name: &str) -> Option<&'static str> {
    if is_excused(name) {
        return None;
    }
    let double = [
        "__aeabi_d",
        "__aeabi_f2d",
        "__aeabi_i2d",
        "__aeabi_ui2d",
        "__aeabi_l2d",
        "__aeabi_ul2d",
        "__aeabi_cd",
    ];
    if name.contains("panicking") || name.contains("unwrap_failed") || name.contains("rust_begin_unwind") {
        Some("it panics")
    } else if double.iter().any(|prefix| name.starts_with(prefix))
        || name.contains("compiler_builtins::float") && name.contains("f64")
    {
        Some("it computes in double precision, by software")
    } else if name.contains("__rust_alloc") || name.contains("alloc::alloc") {
        Some("it allocates")
    } else {
        None
    }
}

/// Follows every branch from the tasks of `image`.
///
/// # Errors
/// When the image has no task.
pub fn reached(image: &ElfImage) -> Result<ReachableCalls, BoardError> {
    let by_address: BTreeMap<u32, &Function> =
        image.functions.iter().map(|function| (function.address, function)).collect();
    let is_root = |function: &&&Function| ROOTS.iter().any(|root| function.name.contains(root));
    let mut to_follow: Vec<&Function> = by_address.values().filter(is_root).copied().collect();
    if !to_follow.iter().any(|function| function.name.contains(ROOTS[0])) {
        return Err(BoardError::NoTask { task: ROOTS[0] });
    }
    let mut seen: BTreeSet<u32> = to_follow.iter().map(|function| function.address).collect();
    let mut forbidden = Vec::new();
    while let Some(function) = to_follow.pop() {
        for branch in branches(function, &image.code_from) {
            let mut forbid = |callee: &str, reason| {
                let (caller, callee) = (function.name.clone(), callee.to_owned());
                forbidden.push(ForbiddenCall { caller, callee, reason });
            };
            match branch {
                Branch::ByAddress => forbid("a function by address", "its target cannot be followed"),
                Branch::To(address) => match holding(&by_address, address) {
                    None => forbid(&format!("{address:#x}"), "no function is there"),
                    Some(callee) => {
                        if let Some(reason) = reason(&callee.name) {
                            forbid(&callee.name, reason);
                        } else if !is_excused(&callee.name) && seen.insert(callee.address) {
                            to_follow.push(callee);
                        }
                    }
                },
            }
        }
    }
    forbidden.dedup();
    Ok(ReachableCalls { functions: seen.len(), forbidden })
}

/// The function whose code is at `address`.
pub(super) fn holding<'a>(by_address: &BTreeMap<u32, &'a Function>, address: u32) -> Option<&'a Function> {
    let (_, function) = by_address.range(..=address).next_back()?;
    ((address - function.address) as usize).lt(&function.bytes.len()).then_some(*function)
}

/// The branches out of a function.
fn branches(function: &Function, code_from: &[(u32, bool)]) -> Vec<Branch> {
    branches_at(function, code_from).into_iter().map(|(_, branch)| branch).collect()
}

/// The same, each with the address of its instruction.
pub(super) fn branches_at(function: &Function, code_from: &[(u32, bool)]) -> Vec<(u32, Branch)> {
    let end = function.address + u32::try_from(function.bytes.len()).unwrap_or(u32::MAX);
    let branch = |(at, first, second)| match second {
        Some(second) => wide(at, first, second),
        None => narrow(at, first),
    };
    let leads_out =
        |branch: &Branch| !matches!(branch, Branch::To(to) if (function.address..end).contains(to));
    let instructions = instructions(function, code_from).into_iter();
    instructions.filter_map(|code| branch(code).filter(leads_out).map(|branch| (code.0, branch))).collect()
}

/// The instructions of a function: the address, the first half, and the second half of those that have one.
pub(super) fn instructions(function: &Function, code_from: &[(u32, bool)]) -> Vec<(u32, u32, Option<u32>)> {
    let Function { address: start, bytes, .. } = function;
    let half = |at: u32| -> Option<u32> {
        let offset = (at - start) as usize;
        bytes.get(offset..offset + 2).map(|pair| u32::from(pair[0]) | u32::from(pair[1]) << 8)
    };
    let is_code = |at: u32| {
        let next = code_from.partition_point(|(from, _)| *from <= at);
        next.checked_sub(1).is_none_or(|last| code_from[last].1)
    };
    let mut instructions = Vec::new();
    let mut at = *start;
    while let Some(first) = half(at) {
        let is_wide = is_code(at) && first >> 11 > 0b11100;
        if is_code(at) {
            instructions.push((at, first, if is_wide { half(at + 2) } else { None }));
        }
        at += if is_wide { 4 } else { 2 };
    }
    instructions
}

/// The value of the lowest `bits` of `value`, the highest of them its sign.
fn signed(value: u32, bits: u32) -> u32 {
    ((value << (32 - bits)).cast_signed() >> (32 - bits)).cast_unsigned()
}

/// The target of a branch at `at`: the program counter is four bytes ahead.
fn to(at: u32, offset: u32) -> Branch {
    Branch::To(at.wrapping_add(4).wrapping_add(offset))
}

pub(super) fn narrow(at: u32, code: u32) -> Option<Branch> {
    match code {
        0xe000..=0xe7ff => Some(to(at, signed(code << 1, 12))),
        // Conditions 14 and 15 are other instructions.
        0xd000..=0xddff => Some(to(at, signed(code << 1, 9))),
        _ if code & 0xff87 == 0x4780 => Some(Branch::ByAddress),
        // BX, but for the return by the link register.
        _ if code & 0xff87 == 0x4700 && code != 0x4770 => Some(Branch::ByAddress),
        _ => None,
    }
}

pub(super) fn wide(at: u32, first: u32, second: u32) -> Option<Branch> {
    if first >> 11 != 0b11110 || second >> 15 != 1 {
        return None;
    }
    let (s, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let low = (second & 0x7ff) << 1;
    if second >> 12 & 1 == 1 {
        // BL and B.W; with bit 14 set and bit 12 clear it would be BLX to another instruction set.
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let offset = s << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | low;
        return Some(to(at, signed(offset, 25)));
    }
    let condition = first >> 6 & 0xf;
    if second >> 14 & 1 == 0 && condition < 14 {
        let offset = s << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | low;
        return Some(to(at, signed(offset, 21)));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(name: &str, address: u32, halves: &[u16]) -> Function {
        let bytes = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        Function { name: name.to_owned(), address, bytes }
    }

    /// Encodings as an assembler gives them (`llvm-mc -triple=thumbv7em -show-encoding`).
    #[test]
    fn tool_branches_lead_where_an_assembler_says() {
        for (halves, expected) in [
            (&[0xf000, 0xf87e][..], Branch::To(0x1100)),
            (&[0xf7ff, 0xff7e], Branch::To(0xf00)),
            (&[0xf000, 0xb87e], Branch::To(0x1100)),
            (&[0xf43f, 0xaf7e], Branch::To(0xf00)),
            (&[0xe77e], Branch::To(0xf00)),
            (&[0xd07e], Branch::To(0x1100)),
            (&[0x4798], Branch::ByAddress),
            (&[0x4718], Branch::ByAddress),
        ] {
            assert_eq!(branches(&function("f", 0x1000, halves), &[]), [expected], "{halves:x?}");
        }
        // A return, a branch within the function, a supervisor call, arithmetic with a wide constant.
        for halves in [&[0x4770][..], &[0xe7fe], &[0xdf01], &[0xf04f, 0x30ff], &[0xf3ef, 0x8008]] {
            assert_eq!(branches(&function("f", 0x1000, halves), &[]), [], "{halves:x?}");
        }
    }

    fn image(functions: Vec<Function>, code_from: Vec<(u32, bool)>) -> ElfImage {
        ElfImage::of(functions, code_from)
    }

    /// A forbidden function two calls away is found; a constant with the bits of a call is not followed.
    #[test]
    fn exact_what_is_reached_and_what_is_forbidden() {
        let tick = |halves| function(ROOTS[0], 0x1000, halves);
        let rest = || {
            vec![
                function("filter", 0x1100, &[0xf000, 0xb87e]),
                function("core::panicking::panic", 0x1200, &[0x4770]),
                function("__aeabi_dadd", 0x1300, &[0x4770]),
            ]
        };
        let with = |halves| [vec![tick(halves)], rest()].concat();
        let harmless = reached(&image(with(&[0x4770]), vec![])).unwrap();
        assert_eq!(harmless, ReachableCalls { functions: 1, forbidden: vec![] });
        let panics = reached(&image(with(&[0xf000, 0xf87e]), vec![])).unwrap();
        assert_eq!(panics.functions, 2);
        assert_eq!(panics.forbidden[0].to_string(), "filter calls core::panicking::panic: it panics");
        // The same bits as a constant.
        let constant =
            reached(&image(with(&[0xf000, 0xf87e]), vec![(0x1000, false), (0x1004, true)])).unwrap();
        assert_eq!(constant.functions, 1);
        let double = reached(&image(with(&[0xf000, 0xf97e]), vec![])).unwrap();
        assert_eq!(double.forbidden[0].reason, "it computes in double precision, by software");
        let by_address = reached(&image(with(&[0x4798]), vec![])).unwrap();
        assert_eq!(by_address.forbidden[0].callee, "a function by address");
        assert!(matches!(reached(&image(rest(), vec![])), Err(BoardError::NoTask { .. })));
    }
}
