//! The page does what it says, in a headless Chromium, as a visitor uses it: one browser and one page for all cases.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::browser::Browser;
use crate::support::built_command::{folder, json, number};
use crate::support::checkout::{files_below, root};
use crate::support::page::{Served, built};

/// What is wrong with the layout: a list of sentences.
const LAYOUT: &str = include_str!("../support/layout_check.js");
/// What the cases share on the page: waiting, and using it as a visitor does.
const VISITOR: &str = include_str!("../support/visitor.js");
/// A phone, a small window, a large one.
const WIDTHS: [u32; 3] = [360, 800, 1400];
/// A page that is loaded at once over a slow line.
const BYTES_MAX: u64 = 1_000_000;
/// Time until something moves, in ms.
const FIRST_MOTION_MAX_MS: f64 = 2000.0;
/// Bytes of the picture in the README, which a visitor of the repository loads.
const PICTURE_MAX: u64 = 150_000;

struct Visit {
    browser: Browser,
    served: Served,
    problems: Vec<String>,
}

impl Visit {
    /// Opens the page with a scene in its address.
    fn open(&self, scene: &str) {
        self.browser.show(WIDTHS[2], "screen", "light");
        let hash = if scene.is_empty() { String::new() } else { format!("#{scene}") };
        self.browser.open_address(&format!("{}{hash}", self.served.address()));
        self.browser.evaluate(VISITOR);
        self.browser.promised("visitor.moves()");
    }

    /// What the page has complained about; its own files are no complaint.
    fn complaints(&self) -> Vec<String> {
        let own = format!("asks for \"{}", self.served.address());
        let mut complaints = self.browser.complaints();
        complaints
            .retain(|complaint| !complaint.starts_with(&own) && !complaint.starts_with("asks for \"data:"));
        complaints
    }

    /// Notes what is wrong now.
    fn look(&mut self, what: &str) {
        let layout = self.browser.evaluate(LAYOUT);
        let found = layout.as_array().expect("a list").iter().filter_map(Value::as_str).map(str::to_owned);
        let found: Vec<_> = found.chain(self.complaints()).collect();
        self.problems.extend(found.into_iter().map(|problem| format!("{what}: {problem}")));
        let cut = self.browser.evaluate("visitor.cutTexts()");
        if cut != "" {
            self.problems.push(format!("{what}: {cut} is wider than its picture"));
        }
    }

    fn check(&mut self, holds: bool, problem: &str) {
        if !holds {
            self.problems.push(problem.to_owned());
        }
    }
}

/// Everything that is loaded is small, and comes from the page's own folder before the first motion.
fn loads_and_moves(visit: &mut Visit) {
    visit.open("");
    let first_ms = visit.browser.evaluate("Number(document.body.dataset.first)").as_f64().expect("a time");
    visit.check(first_ms < FIRST_MOTION_MAX_MS, &format!("first motion after {first_ms} ms"));
    let loaded = visit.browser.evaluate("visitor.loaded()");
    let own = visit.served.address().to_owned();
    for name in loaded.as_array().expect("names").iter().filter_map(Value::as_str) {
        visit.check(name.starts_with(&own), &format!("loads {name}"));
    }
    let drawn = visit.browser.promised("visitor.canvasesChange()");
    visit.check(drawn == true, "the pictures stand still");
}

/// Whether a move to a target is said to have ended there: within three tolerances of 0.001 degrees, as a move that is
/// not wrong ([`simulation::runs::position::MoveEnding`]).
fn reached(said: &str, target: &str) -> bool {
    let error = said.split("error ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    said.starts_with(&format!("Target {target}°: ")) && error.is_some_and(|mdeg| mdeg.abs() <= 3.0)
}

/// A target that is typed is reached, and the page says so: with the error of the command for the same scene.
fn moves_to_a_typed_target(visit: &mut Visit) {
    visit.browser.evaluate("visitor.speed(0); document.getElementById('target').focus()");
    visit.browser.evaluate("document.getElementById('target').select()");
    visit.browser.write("37");
    visit.browser.press("Enter");
    let said = visit.browser.promised("visitor.said(37)");
    let said = said.as_str().unwrap_or_default().to_owned();
    visit.check(reached(&said, "37"), &format!("of a typed target is said: {said}"));
    // From the start it is the command's run.
    visit.browser.evaluate("visitor.forget(); document.getElementById('restart').click()");
    let said = visit.browser.promised("visitor.said(37)");
    let said = said.as_str().unwrap_or_default().to_owned();
    let hash = visit.browser.evaluate("location.hash.slice(1)");
    visit.check(hash == "position.to_deg=37", &format!("the address has {hash}"));
    let folder = folder();
    let outcome =
        json(folder.path(), &["position", "--set", hash.as_str().unwrap_or_default(), "--format", "json"]);
    let error = format!("error {:+.3} mdeg", number(&outcome, "final_error_mdeg"));
    visit.check(said.contains(&error), &format!("the command ends with {error}, the page says: {said}"));
    // Keys on the handle.
    visit.browser.evaluate("document.getElementById('handle').focus()");
    visit.browser.press("ArrowRight");
    let now = visit.browser.evaluate("document.getElementById('handle').getAttribute('aria-valuenow')");
    visit.check(now == "38", &format!("an arrow key moves the target from 37 to {now}"));
    let said = visit.browser.promised("visitor.said(38)");
    let said = said.as_str().unwrap_or_default();
    visit.check(reached(said, "38"), &format!("of a target set by keys is said: {said}"));
    // A target that is refused leaves that of the motor that runs.
    visit.browser.promised("visitor.asked(() => visitor.target(1e6))");
    let hash = visit.browser.evaluate("location.hash.slice(1)");
    visit.check(hash == "position.to_deg=38", &format!("after a refused target the address has {hash}"));
    // A target that is set while an answer of the move before is on its way: that answer is not the new move's end.
    visit.browser.evaluate("visitor.forget(); visitor.meanwhile(() => visitor.target(41))");
    let said = visit.browser.promised("visitor.said(41)");
    let said = said.as_str().unwrap_or_default();
    visit.check(reached(said, "41"), &format!("of a target set during an answer is said: {said}"));
}

/// Every slider at both ends: the motor runs, or the refusal names the key.
fn takes_every_setting(visit: &mut Visit) {
    for rotor in ["height_only", "tilting"] {
        visit.open(&format!("plant.rotor={rotor}"));
        let wrong = visit.browser.promised(&format!("visitor.everySlider({})", rotor == "tilting"));
        let tried = wrong["tried"].as_u64().expect("a count");
        let least = if rotor == "tilting" { 30 } else { 80 };
        visit.check(tried >= least, &format!("{rotor}: {tried} ends of sliders"));
        for problem in wrong["problems"].as_array().expect("a list").iter().filter_map(Value::as_str) {
            visit.problems.push(format!("{rotor}: {problem}"));
        }
        visit.look(&format!("{rotor}: sliders"));
    }
}

/// Every fault begins and ends, and a scene's address has it.
fn makes_every_fault(visit: &mut Visit) {
    let mut made = BTreeSet::new();
    for rotor in ["height_only", "tilting"] {
        visit.open(&format!("plant.rotor={rotor}"));
        let answer = visit.browser.promised("visitor.everyFault()");
        let names = answer["made"].as_array().expect("a list").iter().filter_map(Value::as_str);
        made.extend(names.map(str::to_owned));
        for problem in answer["problems"].as_array().expect("a list").iter().filter_map(Value::as_str) {
            visit.problems.push(format!("{rotor}: {problem}"));
        }
        visit.look(&format!("{rotor}: faults"));
    }
    let words = simulation::scene::faults::WORDS.iter();
    let words: BTreeSet<_> = words.map(|word| format!("{}:{}", word.thing, word.what)).collect();
    visit.check(made == words, &format!("faults made: {made:?}"));
    // A camera that is lost is told by the health, while it is lost.
    visit.open("");
    let health = visit.browser.promised("visitor.healthOfALostCamera()");
    let health = health.as_str().unwrap_or_default();
    let silent = ["unusable: camera silent", "unusable: uncertain"].contains(&health);
    visit.check(silent, &format!("without a camera the estimate is {health}"));
}

/// An address gives its scene back; one that is refused says why and leaves a page that runs.
fn restores_an_address(visit: &mut Visit) {
    let scene =
        "position.to_deg=37&camera.noise_m=3e-6&plant.motor.friction=0.25&faults=camera:lost@0.05..0.07";
    visit.open(scene);
    let command = visit.browser.evaluate("document.getElementById('command').textContent");
    let expected = format!("cargo run --release -- position --set {}", scene.replace('&', " --set "));
    visit.check(command == expected.as_str(), &format!("the command is {command}"));
    let shown = visit.browser.evaluate("visitor.shown(['camera.noise_m', 'plant.motor.friction'])");
    visit.check(shown == "3e-6 0.25", &format!("restored: {shown}"));
    visit.open("camera.noise_m=-1&position.to_deg=3");
    let refused = visit.browser.evaluate("document.getElementById('refused').textContent");
    let refused = refused.as_str().unwrap_or_default();
    let bounds = "camera.noise_m = -1 is outside its bounds 0 to 0.001 m";
    visit.check(refused.contains(bounds), &format!("a wrong address: {refused}"));
}

/// Readable at every width, in light and dark, with everything open, and in every step of the tour.
fn is_readable(visit: &mut Visit) {
    visit.open("");
    visit.browser.evaluate("for (const part of document.querySelectorAll('details')) part.open = true");
    for width in WIDTHS {
        for scheme in ["light", "dark"] {
            visit.browser.show(width, "screen", scheme);
            visit.browser.promised("visitor.pictures(3)");
            visit.look(&format!("{width} px, {scheme}"));
        }
    }
    visit.browser.evaluate("document.getElementById('tour-start').click()");
    // It stays in sight, and so lies on what is scrolled below it.
    visit.browser.evaluate("document.getElementById('tour').style.position = 'static'");
    for step in 1..=8 {
        visit.browser.promised("visitor.pictures(3)");
        let count = visit.browser.evaluate("document.getElementById('tour-count').textContent");
        visit.check(count == format!("Step {step} of 8").as_str(), &format!("step {step}: {count}"));
        visit.look(&format!("tour, step {step}"));
        visit.browser.evaluate("document.getElementById('tour-next').click()");
    }
    let ended = visit.browser.evaluate("document.getElementById('tour').hidden");
    visit.check(ended == true, "the tour does not end");
    let names = visit.browser.evaluate("visitor.nameless()");
    visit.check(names == "", &format!("without a name for a screen reader: {names}"));
}

/// Pictures take no memory that stays: 16 bytes each would be a page of 64 KiB more after 6,000. The curves have a
/// place of fixed size.
fn keeps_its_memory(visit: &mut Visit) {
    visit.open("");
    let memory = visit.browser.promised("visitor.memoryAfter(1000, 6000)");
    visit.check(memory["before"] == memory["after"], &format!("memory of the computing: {memory}"));
    let rows = memory["rows"].as_u64().expect("a count");
    visit.check(rows <= 1000, &format!("a history of 1000 rows holds {rows}"));
}

/// The page as the README shows it.
fn takes_the_picture(visit: &Visit) {
    visit.open("");
    visit.browser.show(1240, "screen", "light");
    visit.browser.promised("visitor.until(() => Number(document.body.dataset.t) > 0.1)");
    visit.browser.evaluate("document.getElementById('pause').click()");
    visit.browser.promised("visitor.pictures(3)");
    let taken = Path::new(env!("CARGO_TARGET_TMPDIR")).join("page.png");
    fs::write(&taken, visit.browser.picture((1240, 1240))).expect("a writable folder");
}

#[test]
fn tool_the_page_works_in_a_browser() {
    let page = built();
    let bytes: u64 = ["html", "css", "js", "wasm"]
        .iter()
        .flat_map(|end| files_below(&page, end))
        .filter(|path| !path.starts_with(page.join("book")))
        .map(|path| fs::metadata(path).expect("a file").len())
        .sum();
    let mut visit = Visit { browser: Browser::start(), served: Served::start(&page), problems: Vec::new() };
    visit.check(bytes <= BYTES_MAX, &format!("the page has {bytes} bytes"));
    loads_and_moves(&mut visit);
    moves_to_a_typed_target(&mut visit);
    visit.look("after moves");
    takes_every_setting(&mut visit);
    makes_every_fault(&mut visit);
    restores_an_address(&mut visit);
    is_readable(&mut visit);
    keeps_its_memory(&mut visit);
    takes_the_picture(&visit);
    assert!(visit.problems.is_empty(), "{}", visit.problems.join("\n"));
}

/// The README's picture is small, and there.
#[test]
fn tool_the_picture_of_the_page_is_small() {
    let picture = fs::metadata(root().join("docs/images/page.png")).expect("docs/images/page.png");
    assert!(picture.len() <= PICTURE_MAX, "docs/images/page.png has {} bytes", picture.len());
}
