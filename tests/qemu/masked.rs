//! For how long the programs of the real boards mask interrupts while their ticks run.

use std::path::Path;

use host_sim::board::{MaskedSection, masked_sections};

use crate::programs::elf_with;

/// The most instructions: by 0.2 us, which 34 are of 170 MHz at one a cycle, the timer's interrupt may come late
/// (firmware/BRINGUP.md, step 5).
const INSTRUCTIONS_MAX: usize = 34;

/// What masks interrupts: the wait for the timer, the number of the tick that the log takes, and the reading of a word
/// of the kept description where it may fault.
#[test]
fn law_no_board_masks_interrupts_for_longer_than_a_fifth_of_a_microsecond() {
    let always = ["__cortex_m_rt_main", "telemetry"];
    for (part, also) in [("stm32g474", &[][..]), ("stm32h743", &["read_word"])] {
        let sections = masked_sections(Path::new(&elf_with(&["board", part]))).expect("an ELF");
        let too_long =
            |section: &&MaskedSection| section.instructions.is_none_or(|count| count > INSTRUCTIONS_MAX);
        let too_long: Vec<_> = sections.iter().filter(too_long).collect();
        assert!(too_long.is_empty(), "{part}: {INSTRUCTIONS_MAX} instructions at most: {too_long:#x?}");
        for function in always.iter().chain(also) {
            assert!(
                sections.iter().any(|section| section.function.contains(function)),
                "{part}: {function} masks them too: {sections:#x?}"
            );
        }
    }
}
