//! The page: built by its own script, and served as its documents say.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// Long enough for a build from nothing on a slow machine.
const BUILD_LIMIT_S: &str = "900";

/// Builds what has changed of the page, and returns its folder.
pub fn built() -> PathBuf {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../web/build.sh");
    // Without what tests/run.sh sets for the harness of the tests: cargo would build everything anew.
    let built = Command::new("timeout").arg(BUILD_LIMIT_S).arg(script).env_remove("RUSTC_BOOTSTRAP").output();
    let Output { status, stdout, stderr } = built.expect("timeout (coreutils) starts");
    assert!(status.success(), "web/build.sh: {status}\n{}", String::from_utf8_lossy(&stderr));
    let printed = String::from_utf8(stdout).expect("text");
    PathBuf::from(printed.lines().last().expect("build.sh names the folder"))
}

/// A file server.
pub struct Served {
    child: Child,
    address: String,
}

impl Served {
    /// Serves a folder on a free port of this machine.
    pub fn start(folder: &Path) -> Self {
        let mut child = Command::new("python3")
            .args(["-u", "-m", "http.server", "0", "--bind", "127.0.0.1", "--directory"])
            .arg(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("python3 starts");
        let mut said = String::new();
        let output = child.stdout.take().expect("its output");
        BufReader::new(output).read_line(&mut said).expect("a line");
        let port = said.split_whitespace().skip_while(|word| *word != "port").nth(1);
        let port: u16 =
            port.and_then(|word| word.parse().ok()).unwrap_or_else(|| panic!("no port in: {said}"));
        Self { child, address: format!("http://127.0.0.1:{port}/") }
    }

    /// The address of the page.
    pub fn address(&self) -> &str {
        &self.address
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
