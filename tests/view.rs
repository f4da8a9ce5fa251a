//! Drives `hbao view` as a person does: a window under Xvfb, a pointer and keys by xdotool. Where the widgets are, and
//! what the window shows, the tests read in the file of `--log`.

#[path = "view/costs.rs"]
mod costs;
#[path = "view/driver.rs"]
mod driver;
#[path = "view/moves.rs"]
mod moves;
mod rig;
#[path = "view/truth.rs"]
mod truth;
#[path = "view/watch.rs"]
mod watch;

use rig::command::{HBAO, by, hbao, with_shader_cache};
use rig::process::skip;
use serde_json::Value;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The longest time that a test waits for one thing. A busy machine with one core renders an image within it.
const PATIENCE: Duration = Duration::from_secs(120);
/// The time between two looks at the log.
const PAUSE: Duration = Duration::from_millis(20);

/// A display without a screen. It ends with the value.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// Starts Xvfb; `None` if it or xdotool is not installed.
    fn start() -> Option<Display> {
        Display::start_with(&[])
    }

    /// Does the same with more arguments for Xvfb.
    fn start_with(arguments: &[&str]) -> Option<Display> {
        let installed = |tool: &str| Command::new(tool).arg("-help").output().is_ok();
        for (tool, package) in [("Xvfb", "xvfb"), ("xdotool", "xdotool")] {
            if !installed(tool) {
                skip(tool, package);
                return None;
            }
        }
        let mut server = Command::new("Xvfb");
        server.args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]);
        let mut server = server.args(arguments).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(server.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        assert!(!line.trim().is_empty(), "Xvfb does not start");
        Some(Display { server, name: format!(":{}", line.trim()) })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The window of a viewer.
struct Window {
    program: Child,
    folder: TempDir,
    display: Display,
}

impl Window {
    /// Opens a window on the Cornell box, and waits for its image. `None` without the tools.
    fn open(arguments: &str) -> Option<Window> {
        Window::open_with(arguments, &[])
    }

    /// Does the same with variables in the environment.
    fn open_with(arguments: &str, environment: &[(&str, &str)]) -> Option<Window> {
        let display = Display::start()?;
        let folder = tempfile::tempdir().unwrap();
        let mut program = hbao(folder.path(), &format!("view --size 420x560 --msaa 1 --log log.json {arguments}"));
        with_shader_cache(&mut program).env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
        program.env("LIBGL_ALWAYS_SOFTWARE", "1").env("WINIT_X11_SCALE_FACTOR", "1");
        program.envs(environment.iter().copied());
        let program = program.stderr(Stdio::piped()).stdin(Stdio::null()).spawn().unwrap();
        let mut window = Window { program, folder, display };
        window.settled(|line| line["image"]["size"] == serde_json::json!([420, 560]));
        // Without a window manager nothing gives the window the keyboard.
        window.xdotool("search --sync --onlyvisible --name hbao windowfocus --sync");
        Some(window)
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    /// The lines of the log so far.
    fn lines(&self) -> Vec<Value> {
        let text = std::fs::read_to_string(self.path("log.json")).unwrap_or_default();
        // The last line may not be complete.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        whole.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// Waits for a frame of which `is` holds.
    fn wait(&mut self, is: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            if let Some(last) = self.lines().pop()
                && is(&last)
            {
                return last;
            }
            if let Some(status) = self.program.try_wait().unwrap() {
                panic!("the window has closed: {status}: {}", self.said());
            }
            assert!(start.elapsed() < PATIENCE, "the last frame: {:?}", self.lines().pop());
            std::thread::sleep(PAUSE);
        }
    }

    /// Waits for a frame of which `is` holds, and which shows the full image of the present settings.
    fn settled(&mut self, is: impl Fn(&Value) -> bool) -> Value {
        self.wait(|line| line["image"]["current"] == true && line["image"]["divisor"] == 1 && is(line))
    }

    /// Waits until half a second passes without a frame, so that nothing moves.
    fn rest(&mut self) {
        let start = Instant::now();
        loop {
            let before = self.wait(|line| line["widgets"].is_object())["frame"].clone();
            std::thread::sleep(Duration::from_millis(500));
            if self.wait(|line| line["widgets"].is_object())["frame"] == before {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "the window does not rest");
        }
    }

    /// What the program has written to stderr. It must have ended.
    fn said(&mut self) -> String {
        let mut text = String::new();
        self.program.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        text
    }

    fn xdotool(&self, arguments: &str) {
        let mut tool = Command::new("xdotool");
        let output = tool.args(arguments.split_whitespace()).env("DISPLAY", &self.display.name).output().unwrap();
        assert!(output.status.success(), "xdotool {arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// The place of a point of a widget in the present frame, x and y from 0 to 1 over its width and height.
    fn point(&mut self, widget: &str, [x, y]: [f64; 2]) -> String {
        let last = self.wait(|line| line["widgets"][widget].is_array());
        let [left, top, width, height] = [0, 1, 2, 3].map(|at| last["widgets"][widget][at].as_f64().unwrap());
        format!("{:.0} {:.0}", left + x * width, top + y * height)
    }

    fn click(&mut self, widget: &str) {
        let middle = self.point(widget, [0.5, 0.5]);
        self.xdotool(&format!("mousemove {middle} click 1"));
    }

    /// Drags the pointer from one point of a widget to another, in steps.
    fn drag(&mut self, widget: &str, from: [f64; 2], to: [f64; 2]) {
        self.drag_by(1, widget, from, to);
    }

    /// Does the same with another button.
    fn drag_by(&mut self, button: u32, widget: &str, from: [f64; 2], to: [f64; 2]) {
        let mut moves = format!("mousemove {} mousedown {button}", self.point(widget, from));
        for step in 1..=5 {
            let share = f64::from(step) / 5.0;
            let at = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            // The pointer leaves at once, in the frame in which the button is pressed. It is then held until a busy
            // machine has drawn a frame.
            let pause = if step == 1 || step == 5 { 0.2 } else { 0.02 };
            moves += &format!(" mousemove {} sleep {pause}", self.point(widget, at));
        }
        self.xdotool(&format!("{moves} mouseup {button}"));
    }

    /// Replaces the text of a field.
    fn write(&mut self, field: &str, text: &str) {
        self.click(field);
        self.xdotool(&format!("key --delay 20 ctrl+a key --delay 20 Delete type --delay 20 {text}"));
        // A press of a button that arrives in the frame of the last letter takes the letter's focus away.
        self.wait(|line| line["fields"].as_array().unwrap().iter().any(|written| written == text));
    }

    /// Closes the window by its key. Nothing may have gone wrong.
    fn close(mut self) {
        self.xdotool("key ctrl+q");
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.program.try_wait().unwrap() {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "the window does not close");
            std::thread::sleep(PAUSE);
        };
        let said = self.said();
        assert!(status.success(), "{status}: {said}");
        assert!(!said.contains("panic"), "{said}");
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// The hash of a PNG's colours that the log has for the image on the screen.
fn hash(png: &Path) -> String {
    let image = image::open(png).unwrap().into_rgb8();
    let hash = image
        .as_raw()
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{hash:016x}")
}

/// Runs the command of a frame in a folder of its own, and returns the file that it writes.
fn by_the_command(frame: &Value, name: &str) -> Vec<u8> {
    written_by(frame["command"].as_str().unwrap(), name)
}

/// Runs a command that the window shows in a folder of its own, and returns a file that it writes.
fn written_by(command: &str, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let line = command.replacen("hbao", HBAO, 1);
    let mut shell = by("sh", folder.path());
    let output = with_shader_cache(shell.args(["-c", &line])).output().unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    std::fs::read(folder.path().join(name)).unwrap()
}

#[test]
fn a_drag_turns_the_scene_and_keys_move_and_reset_it() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    window.drag("image", [0.5, 0.5], [0.7, 0.6]);
    let turned = window.settled(|line| line["command"] != first["command"]);
    assert_ne!(turned["image"]["hash"], first["image"]["hash"]);
    window.xdotool("key r");
    let reset = window.settled(|line| line["command"] == first["command"]);
    assert_eq!(reset["image"]["hash"], first["image"]["hash"]);
    window.xdotool("keydown w sleep 0.3 keyup w");
    window.settled(|line| line["command"] != first["command"]);
    window.xdotool("key r key p");
    let flat = window.settled(|line| line["command"].as_str().unwrap().contains(" --ortho "));
    assert_ne!(flat["image"]["hash"], first["image"]["hash"]);
    window.close();
}

#[test]
fn a_slider_a_key_and_a_side_change_the_image() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    window.drag("knob strength", [0.2, 0.5], [0.5, 0.5]);
    let strong = window.settled(|line| line["settings"] != first["settings"]);
    assert_ne!(strong["image"]["hash"], first["image"]["hash"]);
    assert!(strong["command"].as_str().unwrap().contains(" --strength "));
    // The other side still has the settings of the start.
    window.xdotool("key b");
    let other = window.settled(|line| line["tab"] == 1);
    assert_eq!(other["image"]["hash"], first["image"]["hash"]);
    window.xdotool("key 6");
    let normals = window.settled(|line| line["show"] == "normals");
    assert_ne!(normals["image"]["hash"], first["image"]["hash"]);
    window.xdotool("key 1 key c");
    let both = window.settled(|line| line["image"]["sides"] == 2);
    assert_eq!(both["image"]["hash"], strong["image"]["hash"]);
    window.close();
}

#[test]
fn a_saved_image_is_the_one_on_the_screen_and_that_of_the_command() {
    let Some(mut window) = Window::open("--method hbao-talk --half-res --bias 10") else { return };
    let first = window.settled(|_| true);
    window.drag("image", [0.4, 0.5], [0.6, 0.45]);
    window.settled(|line| line["command"] != first["command"]);
    window.xdotool("key 2");
    let shown = window.settled(|line| line["show"] == "ao");
    window.click("save image");
    window.wait(|line| line["said"] == "The image was saved as view.png.");
    let saved = window.path("view.png");
    assert_eq!(hash(&saved), shown["image"]["hash"].as_str().unwrap());

    assert_eq!(std::fs::read(&saved).unwrap(), by_the_command(&shown, "view.png"), "{}", shown["command"]);

    // The clipboard is asked for while the window, which holds its text, is open.
    window.click("copy");
    window.wait(|line| line["said"] == "The command was copied.");
    let mut clipboard = Command::new("xclip");
    clipboard.args(["-o", "-selection", "clipboard"]).env("DISPLAY", &window.display.name);
    match clipboard.output() {
        Ok(output) => assert_eq!(String::from_utf8_lossy(&output.stdout), shown["command"].as_str().unwrap()),
        Err(_) => skip("xclip", "xclip"),
    }

    window.click("save settings");
    window.wait(|line| line["said"] == "The settings were saved as view.toml.");
    let text = std::fs::read_to_string(window.path("view.toml")).unwrap();
    assert_eq!(text, shown["settings"][0].as_str().unwrap());
    window.close();
}

#[test]
fn a_bad_file_is_a_message_and_the_scene_stays() {
    let Some(mut window) = Window::open("") else { return };
    let first = window.settled(|_| true);
    std::fs::write(window.path("bad.obj"), "v 0 0\n").unwrap();
    let floor = "v 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 0 4\nv 0 3 0\nv 4 3 0\nf 1 2 3 4\nf 1 2 6 5\n";
    std::fs::write(window.path("step.obj"), floor).unwrap();
    for bad in ["missing.obj", "bad.obj"] {
        window.write("field open", bad);
        window.xdotool("key Return");
        let refused = window.wait(|line| line["message"].as_str().is_some_and(|message| message.contains(bad)));
        assert_eq!(refused["scene"], "cornell-box");
        let same = window.settled(|_| true);
        assert_eq!(same["image"]["hash"], first["image"]["hash"]);
    }
    window.write("field open", "step.obj");
    window.click("open");
    let opened = window.settled(|line| line["scene"] == "step.obj");
    assert_ne!(opened["image"]["hash"], first["image"]["hash"]);
    assert!(opened["message"].is_null() && opened["command"].as_str().unwrap().ends_with(" step.obj"));
    window.close();
}

#[test]
fn without_a_display_there_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut program = hbao(folder.path(), "view");
    program.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let output = with_shader_cache(&mut program).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr).unwrap();
    let lines: Vec<_> = text.lines().filter(|line| !line.contains("OpenGL ")).collect();
    assert!(lines.len() == 1 && lines[0].contains("no window can be opened"), "{text}");
}
