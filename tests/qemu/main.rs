//! The microcontroller's programs, built for it and run on an emulated one: the bits against the same code on the host,
//! the instructions against counts that were reviewed, the loop with the simulated motor.

mod board;
mod instructions;
mod masked;
mod part_rates;
mod pil;
mod programs;
mod script;
mod size;

#[path = "../system/support/browser.rs"]
#[allow(dead_code, reason = "the system tests use the rest of it")]
mod browser;
#[path = "../system/support/page.rs"]
mod page;

use firmware_checks::parity::{LoopRun, TwinRun};
use motor_model::ImpactRule;

use programs::{elf, host_sim, repository, script};

/// A run takes about a second.
const RUN_LIMIT_S: &str = "120";

/// What the page's module computes in a browser.
const IN_THE_BROWSER: &str = "(async () => {
    const { default: load, parity } = await import('./web.js');
    await load({ module_or_path: new URL('web_bg.wasm', location) });
    return parity(); })()";

/// WebAssembly rounds every operation of `f32` as the microcontroller does; one libm serves all three.
#[test]
fn tool_emulated_cortex_m4f_and_webassembly_compute_the_bits_of_the_host() {
    let target = script("qemu.sh", RUN_LIMIT_S, &[&elf("parity")]);
    let served = page::Served::start(&page::built());
    let browser = browser::Browser::start();
    browser.open_address(served.address());
    let webassembly = browser.promised(IN_THE_BROWSER);
    let twin = |rule| TwinRun::compute(rule).expect("the nominal motor is within bounds");
    let whole_loop = LoopRun::compute(&mut None).expect("the targets are within bounds");
    let host = format!("{}\n{}\n{whole_loop}\n", twin(ImpactRule::EndOfStep), twin(ImpactRule::Located));
    assert!(host.contains("\ntwin_digest 0x") || host.starts_with("twin_digest 0x"), "{host}");
    assert!(host.contains("located_twin_digest 0x") && host.contains("loop_digest 0x"), "{host}");
    assert_eq!(target, host, "left: target, right: host");
    assert_eq!(webassembly, host.as_str(), "left: WebAssembly, right: host");
}
