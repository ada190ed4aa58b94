//! Which filters a part has time for, as `host-sim parts` finds. The build script reads this file too: a program for a
//! part leaves the others out, although their features are on, unless `every_filter` is on as well.
//!
//! `constant_rate` fits every part, and has no feature.

/// The filters that have a feature of their name, the simplest first.
pub const OPTIONAL_FILTERS: [&str; 2] = ["impact_aided", "twin"];

/// The parts, by the features of their names, and which of [`OPTIONAL_FILTERS`] each has time for.
pub const PARTS: [(&str, &[&str]); 2] = [("stm32g474", &[]), ("stm32h743", &["impact_aided"])];

/// Whether a program for `part` has time for `filter`. The emulated board is no part, and has time for all.
pub fn has_time(part: Option<&str>, filter: &str) -> bool {
    let of_part = PARTS.iter().find(|&&(name, _)| part == Some(name));
    of_part.is_none_or(|(_, filters)| filters.contains(&filter))
}

/// Whether a program holds `filter`, of those with features `has`.
pub fn is_held(filter: &str, has: impl Fn(&str) -> bool) -> bool {
    let part = PARTS.into_iter().map(|(name, _)| name).find(|name| has(name));
    has(filter) && (has("every_filter") || has_time(part, filter))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    /// A part's program, built with the default features, holds what fits it, and with `every_filter` all of them; a
    /// filter whose feature is off is in none.
    #[test]
    fn exact_a_part_s_program_holds_what_fits_it() {
        let held = |on: &[&str]| -> Vec<&str> {
            OPTIONAL_FILTERS.into_iter().filter(|filter| is_held(filter, |name| on.contains(&name))).collect()
        };
        let (aided, twin) = ("impact_aided", "twin");
        assert_eq!(held(&[aided, twin]), [aided, twin]);
        assert!(held(&["stm32g474", aided, twin]).is_empty() && held(&["stm32h743"]).is_empty());
        assert_eq!(held(&["stm32h743", aided, twin]), [aided]);
        assert_eq!(held(&["stm32g474", "every_filter", twin]), [twin]);
    }
}
