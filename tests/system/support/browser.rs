//! A headless Chromium, spoken to over two pipes in the `DevTools` protocol: JSON messages that end with a zero byte.

use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

/// Longest wait for an answer: far more than a page takes on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running browser with one tab.
pub struct Browser {
    child: Child,
    to: RefCell<File>,
    from: Receiver<Value>,
    session: String,
    next: RefCell<u64>,
    events: RefCell<Vec<Value>>,
    _profile: TempDir,
}

impl Browser {
    /// Starts a browser.
    pub fn start() -> Self {
        let profile = tempfile::tempdir().expect("a temporary folder");
        let [input, output] = ["input", "output"].map(|name| profile.path().join(name));
        let made = Command::new("mkfifo").args([&input, &output]).status().expect("mkfifo");
        assert!(made.success(), "two pipes");
        // The browser reads from file 3 and writes to file 4.
        let script = "exec chromium --headless=new --no-sandbox --disable-gpu --no-first-run --hide-scrollbars \
            --disable-dev-shm-usage --disable-background-networking --remote-debugging-pipe --user-data-dir=\"$1\" \
            about:blank 3<\"$1/input\" 4>\"$1/output\"";
        let child = Command::new("sh")
            .args(["-c", script, "sh"])
            .arg(profile.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromium starts");
        let to = File::options().write(true).open(&input).expect("the browser's input");
        let from = read_messages(File::open(&output).expect("the browser's output"));
        let mut browser = Self {
            child,
            to: RefCell::new(to),
            from,
            session: String::new(),
            next: RefCell::new(0),
            events: RefCell::default(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let attached = browser.call("Target.attachToTarget", &attach);
        attached["sessionId"].as_str().expect("a session").clone_into(&mut browser.session);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), &json!({}));
        }
        browser
    }

    /// Calls a method of the protocol and returns its result.
    #[track_caller]
    pub fn call(&self, method: &str, parameters: &Value) -> Value {
        let id = {
            let mut next = self.next.borrow_mut();
            *next += 1;
            *next
        };
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        let bytes = [message.to_string().as_bytes(), &[0]].concat();
        self.to.borrow_mut().write_all(&bytes).expect("the browser runs");
        loop {
            let answer = self.from.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("no answer to {method}"));
            if answer["id"] == id {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.events.borrow_mut().push(answer);
        }
    }

    /// Opens a file and returns when it is loaded.
    #[track_caller]
    pub fn open(&self, path: &Path) {
        let path = fs::canonicalize(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        self.open_address(&format!("file://{}", path.display()));
    }

    /// Opens an address and returns when it is loaded. The page that is open is left first: a new part after `#` alone
    /// would load nothing.
    #[track_caller]
    pub fn open_address(&self, address: &str) {
        if address.contains('#') {
            self.open_address("about:blank");
        }
        self.events.borrow_mut().clear();
        self.call("Page.navigate", &json!({ "url": address }));
        let loaded = |event: &Value| event["method"] == "Page.loadEventFired";
        while !self.events.borrow().iter().any(loaded) {
            let event = self.from.recv_timeout(PATIENCE).expect("the page is loaded");
            self.events.borrow_mut().push(event);
        }
    }

    /// A window of so many pixels, with the media and the scheme of colours.
    pub fn show(&self, width: u32, media: &str, scheme: &str) {
        let metrics = json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &metrics);
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call("Emulation.setEmulatedMedia", &json!({ "media": media, "features": features }));
    }

    /// Whether pages may run scripts, from the next page on.
    pub fn allow_scripts(&self, allowed: bool) {
        self.call("Emulation.setScriptExecutionDisabled", &json!({ "value": !allowed }));
    }

    /// The value of an expression on the page.
    #[track_caller]
    pub fn evaluate(&self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true });
        let result = self.call("Runtime.evaluate", &parameters);
        assert!(result.get("exceptionDetails").is_none(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// The value that an expression on the page promises.
    #[track_caller]
    pub fn promised(&self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", &parameters);
        assert!(result.get("exceptionDetails").is_none(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Types text into what has the focus.
    pub fn write(&self, text: &str) {
        self.call("Input.insertText", &json!({ "text": text }));
    }

    /// Presses a key by its name: `Enter`, `ArrowRight`, `Tab`.
    pub fn press(&self, key: &str) {
        let text = if key == "Enter" { "\r" } else { "" };
        for kind in ["keyDown", "keyUp"] {
            let code = match key {
                "Enter" => 13,
                "Tab" => 9,
                "PageUp" => 33,
                "ArrowRight" => 39,
                _ => 0,
            };
            let event = json!({
                "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text
            });
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// A picture of the top of the page, so many pixels wide and high, three quarters of that in size: a PNG.
    pub fn picture(&self, (width, height): (u32, u32)) -> Vec<u8> {
        let clip = json!({ "x": 0, "y": 0, "width": width, "height": height, "scale": 0.75 });
        let parameters = json!({ "format": "png", "clip": clip, "captureBeyondViewport": true });
        let shot = self.call("Page.captureScreenshot", &parameters);
        let text = shot["data"].as_str().expect("a picture");
        data_encoding::BASE64.decode(text.as_bytes()).expect("base 64")
    }

    /// The mouse, at a place of the window: `mouseMoved`, `mousePressed` or `mouseReleased`.
    pub fn mouse(&self, kind: &str, (x, y): (f64, f64)) {
        let held = i32::from(kind != "mouseReleased");
        let event = json!({
            "type": kind, "x": x, "y": y, "button": "left", "buttons": held, "clickCount": 1, "pointerType": "mouse"
        });
        self.call("Input.dispatchMouseEvent", &event);
    }

    /// What the page has complained about since it was opened, and what it has asked for beside itself.
    pub fn complaints(&self) -> Vec<String> {
        // An answer comes after the events before it.
        self.evaluate("1");
        let events = self.events.borrow();
        let complaint = |event: &Value| {
            let parameters = &event["params"];
            match event["method"].as_str()? {
                "Runtime.exceptionThrown" => Some(parameters["exceptionDetails"].to_string()),
                "Runtime.consoleAPICalled" => Some(parameters["args"].to_string()),
                "Log.entryAdded" => Some(parameters["entry"]["text"].to_string()),
                "Network.requestWillBeSent" if parameters["type"] != "Document" => {
                    Some(format!("asks for {}", parameters["request"]["url"]))
                }
                _ => None,
            }
        };
        events.iter().filter_map(complaint).collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The messages of the browser, read by a thread of its own.
fn read_messages(output: File) -> Receiver<Value> {
    let (send, receive) = channel();
    std::thread::spawn(move || {
        for message in BufReader::new(output).split(0) {
            let Ok(message) = message else { return };
            let Ok(value) = serde_json::from_slice(&message) else { return };
            if send.send(value).is_err() {
                return;
            }
        }
    });
    receive
}
