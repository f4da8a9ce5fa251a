//! Drives Chromium without a window, by the DevTools protocol over a pipe.

use crate::rig::process::skip;
use serde_json::{Value, json};
use std::cell::{Cell, RefCell};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tempfile::TempDir;

/// The names under which systems have the browser.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// How long an answer may take before the browser counts as dead.
const PATIENCE: Duration = Duration::from_secs(300);

/// A browser with one page open.
pub(super) struct Browser {
    child: Child,
    commands: RefCell<ChildStdin>,
    messages: Receiver<Value>,
    next: Cell<u64>,
    session: RefCell<Option<String>>,
    /// What the page's console was told as warnings or errors, and what its scripts threw.
    complaints: RefCell<Vec<String>>,
    _profile: TempDir,
}

impl Browser {
    /// Opens a page of HTML. `None`, with a line that says so, if there is no browser.
    pub(super) fn open(page: &Path, width: u32, scripts: bool) -> Option<Browser> {
        let is_there = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success());
        let Some(name) = NAMES.into_iter().find(is_there) else {
            skip("chromium", "chromium");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        // The browser reads its commands from file 3, and answers on file 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<&0 4>&1 0</dev/null 1>/dev/null 2>&1", "sh", name])
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"])
            .args(["--remote-debugging-pipe", &format!("--user-data-dir={}", profile.path().display())])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, messages) = channel();
        let answers = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for message in answers.split(0).map_while(Result::ok) {
                let Ok(message) = serde_json::from_slice(&message) else { break };
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let browser = Browser {
            commands: RefCell::new(child.stdin.take().unwrap()),
            child,
            messages,
            next: Cell::new(1),
            session: RefCell::new(None),
            complaints: RefCell::default(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attached = browser.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        *browser.session.borrow_mut() = attached["sessionId"].as_str().map(String::from);
        for domain in ["Page", "Runtime", "Log"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser.call("Emulation.setScriptExecutionDisabled", json!({ "value": !scripts }));
        browser.resize(width);
        browser.call("Page.navigate", json!({ "url": format!("file://{}", page.display()) }));
        browser.until("document.readyState === 'complete' && [...document.images].every(image => image.complete)");
        Some(browser)
    }

    /// Gives the window this width in pixels.
    pub(super) fn resize(&self, width: u32) {
        let metrics = json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Shows the page as on this medium, to a reader who prefers this scheme of colours.
    pub(super) fn emulate(&self, medium: &str, scheme: &str) {
        let scheme = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call("Emulation.setEmulatedMedia", json!({ "media": medium, "features": scheme }));
    }

    /// Evaluates an expression in the page, and returns its value.
    pub(super) fn value(&self, expression: &str) -> Value {
        let asked = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let mut answer = self.call("Runtime.evaluate", asked);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].take()
    }

    /// Waits until an expression is true in the page.
    pub(super) fn until(&self, expression: &str) {
        let start = std::time::Instant::now();
        while self.value(expression) != true {
            assert!(start.elapsed() < PATIENCE, "it never became true: {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Asserts that an expression, which lists what is wrong, lists nothing.
    pub(super) fn assert_none(&self, what: &str, expression: &str) {
        let found = self.value(expression);
        assert_eq!(found, json!([]), "{what}");
    }

    /// Moves the mouse to the middle of an element, or to this share of its width, and presses its button if told to.
    pub(super) fn point(&self, selector: &str, share: f64, press: bool) {
        let at = self.value(&format!(
            "(() => {{ const element = document.querySelector({selector:?}); \
             element.scrollIntoView({{ block: 'center', behavior: 'instant' }}); \
             const box = element.getBoundingClientRect(); \
             return [box.left + box.width * {share}, box.top + box.height / 2]; }})()"
        ));
        let mouse = |kind: &str, buttons: u32| {
            let button = if kind == "mouseMoved" { "none" } else { "left" };
            let event =
                json!({ "type": kind, "x": at[0], "y": at[1], "button": button, "buttons": buttons, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
        };
        mouse("mouseMoved", 0);
        if press {
            mouse("mousePressed", 1);
            mouse("mouseReleased", 0);
        }
    }

    /// Prints the page, and returns the PDF in base 64.
    pub(super) fn print(&self) -> String {
        let printed = self.call("Page.printToPDF", json!({ "printBackground": false }));
        printed["data"].as_str().unwrap().into()
    }

    /// Asserts that the console was told nothing and no script threw.
    pub(super) fn assert_quiet(&self) {
        assert_eq!(*self.complaints.borrow(), Vec::<String>::new());
    }

    fn call(&self, method: &str, parameters: Value) -> Value {
        let id = self.next.replace(self.next.get() + 1);
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if let Some(session) = &*self.session.borrow() {
            message["sessionId"] = session.as_str().into();
        }
        let mut commands = self.commands.borrow_mut();
        commands.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let mut message = self.messages.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{method}: {e}"));
            if message["id"] == id {
                assert!(message.get("error").is_none(), "{method}: {message}");
                return message["result"].take();
            }
            let event = message["method"].as_str().unwrap_or_default();
            let told = event == "Runtime.consoleAPICalled" || event == "Log.entryAdded";
            if told || event == "Runtime.exceptionThrown" {
                self.complaints.borrow_mut().push(message["params"].to_string());
            }
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
