//! `--report`: one HTML file, whole and readable in a real browser at every width, in light and dark, in print, without
//! scripts.

use std::path::Path;

use serde_json::Value;

use crate::support::browser::Browser;
use crate::support::built_command::{folder, refuses, succeeds, written};

/// What is wrong with the layout: a list of sentences.
const LAYOUT: &str = include_str!("../support/layout_check.js");
/// A phone, a small window, a large one.
const WIDTHS: [u32; 3] = [360, 800, 1400];
/// An A4 page at 96 pixels an inch, without margins of 15 mm.
const PRINTED_WIDTH: u32 = 680;

/// A step that makes a small study quick.
const COARSE: &str = "plant.step_s=1e-5";

/// Reports by name: the command that writes each, and the pictures that it writes beside it.
const REPORTS: &[(&str, &[&str], &[&str])] = &[
    ("move", &["position", "--fault", "camera:lost@0.05..0.06", "--out", "move.svg"], &["move.svg"]),
    (
        "given_up",
        &[
            "position",
            "--to",
            "3",
            "--fault",
            "drive:dead:b",
            "--set",
            "position.deadline_s=1",
            "--out",
            "given_up.svg",
        ],
        &["given_up.svg"],
    ),
    (
        "tilting",
        &["position", "--to", "-5", "--scene", "set_f_plant", "--out", "tilting.svg"],
        &["tilting.svg"],
    ),
    ("rate", &["rate", "--duration", "1", "--out", "rate.svg"], &["rate.svg"]),
    ("motion", &["simulate", "--drive", "b", "--duration", "0.6"], &[]),
    ("tilting_motion", &["simulate", "--scene", "set_f", "--duration", "0.6"], &[]),
    (
        "estimate",
        &["estimate", "--motors", "2", "--set", COARSE, "--beside", "camera.marks=3"],
        &["out/estimate/estimate.svg"],
    ),
    (
        "trials",
        &["positioning-trials", "--motors", "3", "--compare", "1", "--set", COARSE],
        &["out/positioning-trials/positioning-trials.svg"],
    ),
    (
        "calibrate",
        &[
            "calibrate",
            "--runs",
            "2",
            "--motors",
            "1",
            "--duration",
            "6",
            "--set",
            "calibrate.steps=1",
            "--set",
            COARSE,
        ],
        &["out/calibrate/calibrate.svg"],
    ),
    ("filters", &["filters", "--motors", "1", "--host-only", "--set", COARSE], &["out/filters/filters.svg"]),
    (
        "instruments",
        &["instruments", "--motors", "1", "--only", "camera noise", "--set", COARSE],
        &["out/instruments/instruments.svg"],
    ),
    ("faults", &["faults", "--runs", "6", "--set", COARSE], &["out/faults/faults.svg"]),
    (
        "identify",
        &["identify", "run.mcap", "ring.mcap", "--motors", "100", "--no-advice"],
        &["out/identify/posterior.svg", "out/identify/fit.svg"],
    ),
    ("compare", &["compare", "a.json", "b.json"], &[]),
];

/// Two results with key figures of every kind: equal, within noise, better, worse, without a measure of chance.
fn write_results(folder: &Path) {
    let figure = |name: &str, better: &str, measured: &str| {
        format!(
            "{{\"of\":\"twin\",\"name\":\"{name}\",\"unit\":\"mdeg\",\"better\":\"{better}\",{measured}}}"
        )
    };
    let mean = |value: f64| format!("\"kind\":\"mean\",\"value\":{value},\"sd\":0.5,\"runs\":20");
    for (name, seed, offset) in [("a.json", 1, 0.0), ("b.json", 2, 2.0)] {
        let figures = [
            figure("same", "lower", &mean(1.0)),
            figure("little", "lower", &mean(3.0 + 0.01 * offset)),
            figure("error", "lower", &mean(3.0 + offset)),
            figure("success", "higher", &mean(3.0 + offset)),
            figure(
                "failures",
                "lower",
                &format!("\"kind\":\"count\",\"value\":{offset},\"runs\":50").replace(".0", ""),
            ),
            figure("single", "neither", &format!("\"kind\":\"single\",\"value\":{offset}")),
        ];
        let text = format!(
            "{{\"command\":\"estimate\",\"version\":\"0.1.0\",\"scene\":{{\"seed\":{seed}}},\"key_figures\":[{}],\
             \"wall_s\":{offset},\"rows\":[{offset}]}}",
            figures.join(",")
        );
        std::fs::write(folder.join(name), text).expect("a folder");
    }
}

/// Short recordings of a motor.
fn write_recordings(folder: &Path) {
    let motor = ["record", "--schedule", "b:1 for 0.06, off for 0.02", "--log", "run.mcap"];
    succeeds(folder, &motor);
    let stator = ["record", "--model", "stator", "--schedule", "b:1 for 0.02, off for 0.012"];
    succeeds(folder, &[&stator[..], &["--log", "ring.mcap"]].concat());
}

fn write_reports(folder: &Path) {
    write_results(folder);
    write_recordings(folder);
    for (name, arguments, _) in REPORTS {
        let report = format!("{name}.html");
        succeeds(folder, &[*arguments, &["--report", &report, "--quiet"]].concat());
    }
}

/// Adds what is wrong with the page that is open, as it is shown.
fn look(browser: &Browser, what: &str, problems: &mut Vec<String>) {
    let found = browser.evaluate(LAYOUT);
    let found = found.as_array().expect("a list").iter().filter_map(Value::as_str);
    problems.extend(found.map(|problem| format!("{what}: {problem}")));
}

/// The text of the page's sections, but for what a script writes.
const CONTENT: &str = "(() => { const page = document.querySelector('main').cloneNode(true);
    for (const made of page.querySelectorAll('output, .whole, .cursor')) made.remove();
    return [page.textContent.replace(/\\s+/g, ' '), page.querySelectorAll('svg path').length]; })()";

/// Points at the first picture, enlarges a part of it if both axes are numbers, and goes back.
fn point_and_zoom(browser: &Browser, name: &str, problems: &mut Vec<String>) {
    browser.show(800, "screen", "light");
    let count = |selector: &str| browser.evaluate(&format!("document.querySelectorAll('{selector}').length"));
    if count(".plot") == 0 {
        problems.push(format!("{name}: no picture"));
        return;
    }
    let place = browser.evaluate(
        "(() => { const plot = document.querySelector('.plot'); plot.scrollIntoView({ block: 'center' });
        const box = plot.getBoundingClientRect(); return [box.left, box.top, box.width, box.height]; })()",
    );
    let place: Vec<f64> = place.as_array().expect("a box").iter().filter_map(Value::as_f64).collect();
    let at = |x: f64, y: f64| (place[0] + x * place[2], place[1] + y * place[3]);
    let view = || browser.evaluate("document.querySelector('.plot svg').getAttribute('viewBox')");
    let whole = view();
    browser.mouse("mouseMoved", at(0.5, 0.5));
    let said = browser.evaluate("document.querySelector('.readout').textContent");
    if said.as_str().is_none_or(|said| !said.contains(": ")) {
        problems.push(format!("{name}: under the pointer stands {said}"));
    }
    let of_names = "document.querySelector('.chart').querySelector('.named') !== null";
    if browser.evaluate(of_names) == true {
        return;
    }
    browser.mouse("mousePressed", at(0.2, 0.2));
    browser.mouse("mouseMoved", at(0.6, 0.8));
    browser.mouse("mouseReleased", at(0.6, 0.8));
    if view() == whole {
        problems.push(format!("{name}: dragging does not enlarge"));
    }
    look(browser, &format!("{name}, enlarged"), problems);
    browser.evaluate("document.querySelector('.whole').click()");
    if view() != whole {
        problems.push(format!("{name}: the whole picture does not come back"));
    }
}

/// Pages with one fault each, and what is said of it.
const FAULTY: &[(&str, &str)] = &[
    ("<p style='position:absolute;top:0'>one</p><p style='position:absolute;top:4px'>two</p>", "lies on"),
    ("<p style='white-space:nowrap;width:2000px'>wide</p>", "wide, the window"),
    ("<p style='position:absolute;left:-20px'>cut off</p>", "cut off at the side"),
    ("<svg width=80 height=20><text x=60 y=15>a long text</text></svg>", "cut off at the side"),
    ("<svg width=80 height=20><text x=0 y=22>low</text></svg>", "cut off above or below"),
    ("<svg width=80 height=20><text x=0 y=15>one</text><text x=8 y=15>two</text></svg>", "lies on"),
    ("<p style='color:#bbb'>pale</p>", "contrast"),
    (
        "<p>text</p><div class=plot><svg><path class=line stroke='#eee' d='M0 0h9'></svg></div>",
        "a line line: contrast",
    ),
    ("<p>text</p><script>nothing.at.all</script>", "ReferenceError"),
    ("<p>text</p><script>console.error('wrong')</script>", "wrong"),
    ("<p>text</p><img src='other.png' alt=''>", "asks for"),
];

/// The checks find what they are for: each fault, and none on a page without.
fn assert_faults_are_found(browser: &Browser, folder: &Path) {
    let problems_of = |page: &str| {
        let path = folder.join("faulty.html");
        std::fs::write(&path, format!("<!DOCTYPE html><title>x</title>{page}")).expect("a folder");
        browser.open(&path);
        browser.show(WIDTHS[1], "screen", "light");
        let mut problems = browser.complaints();
        look(browser, "page", &mut problems);
        problems.join("\n")
    };
    for (page, expected) in FAULTY {
        let problems = problems_of(page);
        assert!(problems.contains(expected), "{page}: {problems}");
    }
    assert_eq!(
        problems_of("<p>one</p><p>two</p><svg width=80 height=20><text x=0 y=15>one</text></svg>"),
        ""
    );
}

/// One browser looks at every report and picture.
#[test]
fn tool_reports_are_whole_in_a_browser() {
    let folder = folder();
    write_reports(folder.path());
    for (name, arguments, _) in REPORTS {
        assert_complete(name, arguments, &written(folder.path(), &format!("{name}.html")));
    }
    let browser = Browser::start();
    assert_faults_are_found(&browser, folder.path());
    let mut problems = Vec::new();
    for (name, _, pictures) in REPORTS {
        browser.allow_scripts(true);
        browser.open(&folder.path().join(format!("{name}.html")));
        for width in WIDTHS {
            for scheme in ["light", "dark"] {
                browser.show(width, "screen", scheme);
                look(&browser, &format!("{name}, {width} px, {scheme}"), &mut problems);
            }
        }
        point_and_zoom(&browser, name, &mut problems);
        browser.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })");
        look(&browser, &format!("{name}, tables open"), &mut problems);
        browser.show(PRINTED_WIDTH, "print", "dark");
        look(&browser, &format!("{name}, printed"), &mut problems);
        problems.extend(browser.complaints().into_iter().map(|complaint| format!("{name}: {complaint}")));

        let with_scripts = browser.evaluate(CONTENT);
        browser.allow_scripts(false);
        browser.open(&folder.path().join(format!("{name}.html")));
        browser.show(WIDTHS[0], "screen", "light");
        look(&browser, &format!("{name}, without scripts"), &mut problems);
        if browser.evaluate("document.querySelector('.readout')") != Value::Null {
            problems.push(format!("{name}: a script ran"));
        }
        if browser.evaluate(CONTENT) != with_scripts {
            problems.push(format!("{name}: without scripts something is missing"));
        }
        browser.allow_scripts(true);
        for picture in *pictures {
            browser.open(&folder.path().join(picture));
            browser.show(WIDTHS[1] + 100, "screen", "light");
            look(&browser, picture, &mut problems);
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// Every report has all its parts, a table behind each picture, and the command that repeats it; of a study the key
/// figures stand in it.
fn assert_complete(name: &str, arguments: &[&str], page: &str) {
    for part in ["asked", "pictures", "happened", "sure", "cost", "not-modelled", "repeat"] {
        let section =
            page.split(&format!("<section id=\"{part}\"")).nth(1).unwrap_or_else(|| panic!("{name}: {part}"));
        let content = section.split("</section>").next().unwrap_or_default();
        assert!(
            content.contains("<td>") || content.contains("<p>") || content.contains("<li>"),
            "{name}: {part} is empty"
        );
    }
    let count = |mark: &str| page.matches(mark).count();
    assert!(count("<figure>") > 0 && count("<figure>") == count("Values of this picture"), "{name}");
    assert!(page.contains(&format!("host-sim {} ", arguments[0])), "{name}");
    let of_one_run = ["position", "rate", "simulate", "identify", "compare"].contains(&arguments[0]);
    assert_eq!(page.contains("Key figures with their intervals"), !of_one_run, "{name}");
}

/// A text that would be markup stays text: a path of a scene with a script in its name.
#[test]
fn tool_a_report_escapes_what_it_is_given() {
    let folder = folder();
    let path = "<script>alert(1)<script>.toml";
    std::fs::write(folder.path().join(path), "seed = 3\n[position]\nto_deg = 0.5\n").expect("a folder");
    succeeds(folder.path(), &["position", "--scene", path, "--out", "move.svg", "--report", "move.html"]);
    let page = written(folder.path(), "move.html");
    assert_eq!(page.matches("<script").count(), 1, "the page's own");
    assert!(page.contains("&lt;script&gt;alert(1)&lt;script&gt;.toml:1"), "where the seed comes from");
    assert!(page.contains("host-sim position --scene scene.toml --out move.svg</code>"));
}

/// The result on standard output is the same with a report, and a place that cannot be written is refused before the
/// run.
#[test]
fn tool_a_report_changes_no_result() {
    let folder = folder();
    let plain = ["rate", "--duration", "0.5", "--format", "json", "--out", "rate.svg"];
    let with = [&plain[..], &["--report", "rate.html"]].concat();
    assert_eq!(succeeds(folder.path(), &plain), succeeds(folder.path(), &with));
    assert!(written(folder.path(), "rate.html").ends_with("</html>"));
    refuses(folder.path(), &["position", "--report", "nowhere/move.html"], &["nowhere/move.html"]);
    assert!(!folder.path().join("nowhere").exists());
}
