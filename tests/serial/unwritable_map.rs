//! `host-sim run --learn` whose map cannot be written any more when the move has ended.

use controller::ResponseMap;
use serde_json::Value;
use simulation::scene::response_map_text;

use crate::cabled_board::CabledBoard;
use crate::starved::not_starved;
use crate::{SHORT, explained};

/// A folder has taken the place of the map's file meanwhile. That costs neither the log nor the result.
#[test]
fn tool_run_whose_map_cannot_be_written_keeps_its_log_and_its_result() {
    let folder = tempfile::tempdir().expect("a folder");
    let [map, log] = ["map.toml", "run.mcap"].map(|name| folder.path().join(name));
    let [map_name, log_name] = [&map, &log].map(|path| path.to_str().expect("a name in UTF-8"));
    let flags = ["--map", map_name, "--learn", "--format", "json", "--log", log_name];
    let output = not_starved(|| {
        // That of an attempt before.
        let _ = std::fs::remove_dir(&map);
        std::fs::write(&map, response_map_text(ResponseMap::table_1(), &map)).expect("a map");
        let board = CabledBoard::start();
        let mut run = board.run(&[&SHORT[..], &flags].concat());
        board.drives(&mut run)?;
        std::fs::remove_file(&map).expect("a map");
        std::fs::create_dir(&map).expect("a folder");
        let output = run.wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok(output)
    });
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    let error = stderr.lines().last().unwrap_or_default();
    assert!(error.starts_with("error: ") && error.contains("map.toml"), "{stderr}");
    let outcome: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    assert_eq!(outcome["ok"], true, "{outcome}");
    let text = explained(log_name);
    assert!(text.contains("the run ends as it should"), "{text}");
}
