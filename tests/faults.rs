//! What goes wrong around the command: it is killed, disks are full or read-only, folders vanish, readers leave. Each
//! output must then be what it was before, or the complete new file. If an error can be reported, it is reported in one
//! line.
//!
//! Tests that need a disk of their own run in a mount namespace, if the machine permits one.
#![cfg(target_os = "linux")]

#[path = "rig/command.rs"]
#[allow(dead_code, unreachable_pub)]
mod command;
#[path = "rig/process.rs"]
#[allow(dead_code, unreachable_pub)]
mod process;
#[path = "faults/threads.rs"]
mod threads;

use command::{HBAO, by, hbao, with_shader_cache};
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::symlink;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A scene for stdin. The command waits for it after it has checked everything else.
const SCENE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\n";

/// Renders small pictures with few samples into nine files: the output, seven files in the folder, and the times.
const DUMP: &str = "render /dev/stdin -o out.png --dump dump --timings times.json --directions 2 --steps 2 --blur 3";

/// Connects a command to pipes and lets it use a shader cache on the disk, because the tests are about what happens
/// before and after the rendering.
fn with_pipes(mut command: Command) -> Command {
    with_shader_cache(&mut command);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // A shell runs background jobs with SIGINT ignored, `nohup` runs a program with SIGHUP ignored, and a script may
    // ignore any signal. The command would inherit this.
    // SAFETY: between fork and exec only this call is made, which is safe there. It fails for SIGKILL and SIGSTOP,
    // which cannot be ignored.
    unsafe {
        command.pre_exec(|| {
            (1..32).for_each(|signal| _ = libc::signal(signal, libc::SIG_DFL));
            Ok(())
        });
    }
    command
}

fn start(folder: &Path, arguments: &str) -> Child {
    with_pipes(hbao(folder, arguments)).spawn().unwrap()
}

/// Sends the scene to the command and waits for its end.
fn finish(mut child: Child) -> Output {
    let mut stdin = child.stdin.take().unwrap();
    // A command that has already refused reads nothing.
    let _ = stdin.write_all(SCENE.as_bytes());
    drop(stdin);
    child.wait_with_output().unwrap()
}

fn run(folder: &Path, arguments: &str) -> Output {
    finish(start(folder, arguments))
}

/// Returns when the command reads its scene, so that everything before that is done. A pipe can hold only a few of
/// these comments, so this waits until the command reads.
fn wait_for_the_scene(child: &mut Child) {
    child.stdin.as_mut().unwrap().write_all("#\n".repeat(1 << 19).as_bytes()).unwrap();
}

/// Returns the lines of stderr except those that name the backend or say that R is too short.
fn said(output: &Output) -> Vec<String> {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert!(!text.contains("panicked"), "{text}");
    let backend = |line: &&str| line.starts_with("hbao: egl: ") || line.starts_with("hbao: osmesa: ");
    // In so small pictures R is shorter than a texel.
    let radius = |line: &&str| line.contains("visibility is 1") || line.contains("visibility 1");
    text.lines().filter(|line| !backend(line) && !radius(line)).map(String::from).collect()
}

/// Asserts that the command has failed with code 1 and one line that contains `part`.
#[track_caller]
fn assert_failed(output: &Output, part: &str) {
    let lines = said(output);
    assert_eq!(output.status.code(), Some(1), "{lines:?}");
    assert!(lines.len() == 1 && lines[0].starts_with("hbao: ") && lines[0].contains(part), "no {part:?} in {lines:?}");
}

/// Returns the bytes of every file below a folder, by its path. The command may rename and remove files meanwhile: what
/// is gone before it is read is left out.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn unless_gone<T>(result: io::Result<T>) -> Option<T> {
        match result {
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            result => Some(result.unwrap()),
        }
    }
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in unless_gone(fs::read_dir(next)).into_iter().flatten() {
            let path = entry.unwrap().path();
            let Some(kind) = unless_gone(fs::symlink_metadata(&path)).map(|data| data.file_type()) else { continue };
            if kind.is_dir() {
                folders.push(path);
            } else if kind.is_file()
                && let Some(bytes) = unless_gone(fs::read(&path))
            {
                found.insert(path.strip_prefix(folder).unwrap().to_str().unwrap().to_string(), bytes);
            }
        }
    }
    found
}

fn is_temporary(name: &str) -> bool {
    name.rsplit('/').next().unwrap().starts_with(".hbao-")
}

/// Returns the number of files that have been written under a temporary name. The command also makes empty ones, and
/// removes them, before it renders.
fn staged(folder: &Path) -> usize {
    files(folder).iter().filter(|(name, bytes)| is_temporary(name) && !bytes.is_empty()).count()
}

/// Returns the files that an undisturbed run writes. The times in them differ from run to run.
fn whole(arguments: &str) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), arguments);
    assert!(output.status.success(), "{:?}", said(&output));
    let files = files(folder.path());
    assert!(files.len() == 9 && !files.keys().any(|name| is_temporary(name)), "{:?}", files.keys());
    files
}

/// Asserts that each name has the old file or the new one, or nothing if there was none. Returns how many are new.
#[track_caller]
fn assert_whole(folder: &Path, new: &BTreeMap<String, Vec<u8>>, old: bool, when: &str) -> usize {
    let found = files(folder);
    let mut count = 0;
    for (name, expected) in new {
        match found.get(name) {
            None => assert!(!old, "{when}: {name} is gone"),
            Some(bytes) if old && bytes == OLD => {}
            Some(bytes) if name == "times.json" => {
                serde_json::from_slice::<serde_json::Value>(bytes).unwrap_or_else(|e| panic!("{when}: {name}: {e}"));
                count += 1;
            }
            Some(bytes) => {
                assert!(bytes == expected, "{when}: {name} has {} bytes, not {}", bytes.len(), expected.len());
                if name.ends_with(".png") {
                    image::load_from_memory(bytes).unwrap_or_else(|e| panic!("{when}: {name}: {e}"));
                }
                count += 1;
            }
        }
    }
    let others: Vec<_> = found.keys().filter(|name| !new.contains_key(*name) && !is_temporary(name)).collect();
    assert!(others.is_empty(), "{when}: {others:?}");
    count
}

const OLD: &[u8] = b"what was there before";

/// Makes a folder that has an old file under every name.
fn with_old_files(new: &BTreeMap<String, Vec<u8>>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("dump")).unwrap();
    new.keys().for_each(|name| fs::write(folder.path().join(name), OLD).unwrap());
    folder
}

const SIGNALS: [i32; 3] = [libc::SIGKILL, libc::SIGTERM, libc::SIGINT];

/// Sends a signal immediately. Starting another process to do this would take too long.
fn send(child: &Child, signal: i32) {
    // SAFETY: the child has not been waited for, so its number still belongs to it, even if it has ended.
    let _ = unsafe { libc::kill(child.id() as i32, signal) };
}

/// Asserts that the command did not panic, and that it ended by itself or by the signal.
#[track_caller]
fn assert_ended(output: &Output, signal: i32) {
    let status = output.status;
    assert!(status.success() || status.signal() == Some(signal), "{status}: {:?}", said(output));
}

mod killed {
    use super::*;

    /// Otherwise the other tests would wait for the end of a command that ignores the signal.
    #[test]
    fn by_a_signal_that_the_tests_themselves_ignore_it_ends() {
        process::in_own_process("by_a_signal_that_the_tests_themselves_ignore_it_ends", &[], || {
            for signal in [libc::SIGTERM, libc::SIGINT, libc::SIGHUP] {
                // SAFETY: ignoring a signal needs no handler.
                unsafe { libc::signal(signal, libc::SIG_IGN) };
                let folder = tempfile::tempdir().unwrap();
                let mut child = start(folder.path(), "render /dev/stdin -o a.png --size 8x8");
                wait_for_the_scene(&mut child);
                let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
                send(&child, libc::SIGKILL);
                child.wait().unwrap();
                let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
                let ignored = u64::from_str_radix(ignored.trim(), 16).unwrap();
                assert_eq!(ignored >> (signal - 1) & 1, 0, "{signal}: {ignored:x}");
            }
        });
    }

    const KILLS: u32 = 60;

    #[test]
    fn at_any_moment_leaves_each_file_old_or_new() {
        let arguments = format!("{DUMP} --size 160x120");
        let new = whole(&arguments);
        let start_of_run = Instant::now();
        whole(&arguments);
        let duration = start_of_run.elapsed();
        let (mut before, mut after) = (0, 0);
        let mut delay = duration;
        for kill in 0.. {
            // The first kills are spread over the duration of the last run. Further kills come earlier or later, for
            // the case that the machine is slower or faster now.
            match kill {
                0..KILLS => delay = duration * kill / KILLS,
                _ if after == 0 => delay = delay * 3 / 2,
                _ if before == 0 => delay /= 2,
                _ => break,
            }
            assert!(kill < KILLS + 20, "{before} kills before any file had its name, {after} after all had, {delay:?}");
            let old = kill % 2 == 0;
            let folder = if old { with_old_files(&new) } else { tempfile::tempdir().unwrap() };
            let mut child = start(folder.path(), &arguments);
            child.stdin.take().unwrap().write_all(SCENE.as_bytes()).unwrap();
            sleep(delay);
            let signal = SIGNALS[kill as usize % 3];
            send(&child, signal);
            let output = child.wait_with_output().unwrap();
            assert_ended(&output, signal);
            let count = assert_whole(folder.path(), &new, old, &format!("signal {signal} after {delay:?}"));
            // A kill without a delay is not counted, because it is always before any file.
            before += usize::from(count == 0 && !delay.is_zero());
            after += usize::from(count == new.len());
        }
        println!("{before} kills before any file had its name, {after} after all had");
    }

    /// The command is killed at the moment when a certain number of files are being written, or have their names.
    #[test]
    fn while_files_are_written_or_named_leaves_each_old_or_new() {
        // This scene has more than three triangles, so its files are larger.
        let arguments = format!("{} --size 640x480", DUMP.replace("/dev/stdin", "cornell-box"));
        let new = whole(&arguments);
        let (mut written, mut named) = (0, 0);
        // First each signal is sent at each count. Then signals are sent at the first file, until one was met that was
        // being written.
        for kill in 0..300 {
            if kill >= 27 && written > 0 {
                break;
            }
            let (signal, count) = (SIGNALS[kill / 9 % 3], if kill < 27 { 1 + kill % 9 } else { 1 });
            let old = kill >= 27 || kill % 2 == 0;
            let folder = if old { with_old_files(&new) } else { tempfile::tempdir().unwrap() };
            let path = folder.path();
            let entries = |path: &Path| fs::read_dir(path).map_or(0, Iterator::count);
            // Old files exist from the start, so any additional file is being written. Without old files, those with
            // their names are counted.
            let there = || match old {
                true => (entries(path) + entries(&path.join("dump"))).saturating_sub(new.len() + 1),
                false => new.keys().filter(|name| path.join(name).exists()).count(),
            };
            let mut child = start(path, &arguments);
            loop {
                if there() >= count {
                    send(&child, signal);
                    break;
                }
                if child.try_wait().unwrap().is_some() {
                    break;
                }
            }
            let output = child.wait_with_output().unwrap();
            assert_ended(&output, signal);
            let now = assert_whole(path, &new, old, &format!("signal {signal}, {count} there"));
            written += usize::from(files(path).keys().any(|name| is_temporary(name)));
            named += usize::from((1..new.len()).contains(&now));
        }
        assert!(written > 0, "no kill met a file that was being written");
        println!("{written} kills left files under way, {named} some files with and some without their names");
    }

    /// A pipe that nobody reads stops the command when all files are written and none has its name yet.
    #[test]
    fn between_writing_and_naming_leaves_every_old_file() {
        let arguments = format!("{DUMP} --size 64x48");
        let new = whole(&arguments);
        for signal in SIGNALS {
            let folder = with_old_files(&new);
            fs::remove_file(folder.path().join("out.png")).unwrap();
            make_fifo(&folder.path().join("out.png"));
            let mut child = start(folder.path(), &arguments);
            child.stdin.take().unwrap().write_all(SCENE.as_bytes()).unwrap();
            wait_until(&mut child, || staged(folder.path()) == 8);
            send(&child, signal);
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.signal(), Some(signal), "{:?}", said(&output));
            let mut found = files(folder.path());
            found.retain(|name, _| !is_temporary(name));
            assert!(found.len() == 8 && found.values().all(|bytes| bytes == OLD), "{signal}");
        }
    }

    /// This also holds for a report, which takes minutes and starts by opening a context.
    #[test]
    fn before_it_has_rendered_leaves_no_folder_that_it_made() {
        for (arguments, made) in
            [(format!("{DUMP} --size 64x48"), "dump"), ("paper -o report --size 64x48 --runs 1".into(), "report")]
        {
            for signal in SIGNALS {
                let folder = tempfile::tempdir().unwrap();
                let mut child = start(folder.path(), &arguments);
                if made == "report" {
                    child.stderr.as_mut().unwrap().read_exact(&mut [0; 16]).unwrap();
                } else {
                    wait_for_the_scene(&mut child);
                }
                send(&child, signal);
                let output = child.wait_with_output().unwrap();
                assert_eq!(output.status.signal(), Some(signal), "{:?}", said(&output));
                assert!(!folder.path().join(made).exists(), "{signal}: {made}");
            }
        }
    }
}

fn make_fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Waits until something is true. The command must not end before that.
fn wait_until(child: &mut Child, so: impl Fn() -> bool) {
    while !so() {
        let ended = child.try_wait().unwrap();
        if ended.is_some() {
            let mut text = String::new();
            child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
            panic!("it ended early: {text}");
        }
        sleep(Duration::from_millis(1));
    }
}

mod disks {
    use super::*;

    /// Runs `hbao` with a disk of its own, which is mounted at `disk` with these options. Before that, the commands in
    /// `prepare` run on the disk. Returns the output and a list of the files on the disk, or `None` if the machine does
    /// not permit mounting.
    fn on_a_disk(options: &str, prepare: &str, arguments: &str) -> Option<(Output, String)> {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("disk")).unwrap();
        fs::write(folder.path().join("scene.obj"), SCENE).unwrap();
        let script = format!(
            "mount -t tmpfs none disk || exit 77; umount disk; mount -t tmpfs -o {options} none disk || exit 78; cd disk; ({prepare}) >/dev/null 2>&1; cd ..; \
             \"$0\" \"$@\"; code=$?; find disk -type f -size +0 -printf '%P %s\\n' | sort > listing; exit $code"
        );
        let user: &[&str] = if fs::metadata("/proc/self").is_ok_and(|me| std::os::unix::fs::MetadataExt::uid(&me) == 0)
        {
            &[]
        } else {
            &["--user", "--map-root-user"]
        };
        let mut all = with_pipes(by("unshare", folder.path()));
        all.args(user).args(["--mount", "sh", "-c", &script, HBAO]).args(arguments.split_whitespace());
        let output = match all.output() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                process::skip("unshare", "util-linux");
                return None;
            }
            other => other.unwrap(),
        };
        // Either a namespace is not permitted, which unshare itself reports, or a disk in it is not.
        if output.status.code() == Some(77) || output.stderr.starts_with(b"unshare: unshare failed") {
            process::not_permitted("a disk to be mounted");
            return None;
        }
        let listing = fs::read_to_string(folder.path().join("listing"));
        Some((output.clone(), listing.unwrap_or_else(|e| panic!("the script broke: {e}: {output:?}"))))
    }

    const RENDER: &str = "render scene.obj -o disk/out.png --dump disk/dump --timings disk/times.json \
                          --directions 2 --steps 2 --blur 3 --size 160x120";

    #[test]
    fn that_are_full_end_it_in_one_line_with_nothing_left() {
        let mut ends = [0, 0];
        // The limits on the size or the number of files range from nothing at all to enough for everything.
        for limit in
            ["size=4k", "size=16k", "size=64k", "size=128k", "size=256k", "size=1m", "nr_inodes=2", "nr_inodes=5"]
        {
            for old in [false, true] {
                let prepare = if old { "printf before > out.png" } else { "true" };
                let Some((output, listing)) = on_a_disk(limit, prepare, RENDER) else { return };
                if output.status.success() {
                    assert_eq!(listing.lines().count(), 9, "{limit}: {listing}");
                    ends[0] += 1;
                } else {
                    assert_failed(&output, "No space left on device");
                    assert_eq!(listing, if old { "out.png 6\n" } else { "" }, "{limit}");
                    ends[1] += 1;
                }
            }
        }
        println!("{} runs on a full disk, {} on one large enough", ends[1], ends[0]);
        assert!(ends[0] > 0 && ends[1] > 4, "{ends:?}");
    }

    #[test]
    fn that_are_read_only_are_refused_before_anything_is_rendered() {
        for verb in [
            RENDER,
            "truth scene.obj -o disk/t.exr --size 8x8 --truth-rays 2",
            "bench --json disk/b.json --size 8x8",
            "trade --json disk/b.json --size 8x8",
            "tune --max-error 0.5 -o disk/t.toml --size 8x8",
            "paper -o disk --size 64x48",
        ] {
            let prepare = "printf before > out.png; mount -o remount,ro .";
            let Some((output, listing)) = on_a_disk("size=1m", prepare, verb) else { return };
            assert_failed(&output, "Read-only file system");
            assert_eq!(listing, "out.png 6\n", "{verb}");
            assert!(!String::from_utf8_lossy(&output.stderr).contains("llvmpipe"), "{verb}: it opened a context");
        }
    }

    /// A file can be renamed only within one disk.
    #[test]
    fn other_than_the_link_is_on_take_the_file_it_leads_to() {
        let link = "touch there.png; ln -sf disk/there.png ../out.png; ln -sf disk/new.png ../dangling.png";
        for (name, there) in [("out.png", "there.png"), ("dangling.png", "new.png")] {
            let arguments = format!("render scene.obj -o {name} --size 8x8");
            let Some((output, listing)) = on_a_disk("size=1m", link, &arguments) else { return };
            assert!(output.status.success() && said(&output).is_empty(), "{:?}", said(&output));
            assert!(listing.starts_with(there) && listing.lines().count() == 1, "{listing}");
        }
    }

    /// A file that grows too large raises a signal. Its default is to end the process, which would leave behind what
    /// was being written.
    #[test]
    fn that_hold_no_file_so_large_end_it_in_one_line_with_nothing_left() {
        let arguments = format!("{DUMP} --size 160x120");
        let new = whole(&arguments);
        let largest = new.values().map(Vec::len).max().unwrap();
        let mut failed = 0;
        // The limits are in blocks of 512 bytes. All but the last are too small for at least one file.
        for blocks in [0, 1, 2, largest / 2048, largest / 1024, (largest - 1) / 512, largest.div_ceil(512)] {
            for old in [false, true] {
                let folder = if old { with_old_files(&new) } else { tempfile::tempdir().unwrap() };
                let script = format!("ulimit -f {blocks}; exec \"$0\" \"$@\"");
                let mut limited = with_pipes(by("sh", folder.path()));
                // A shader cache could not be written either.
                limited.env("MESA_SHADER_CACHE_DISABLE", "true");
                limited.args(["-c", &script, HBAO]).args(arguments.split_whitespace());
                let output = finish(limited.spawn().unwrap());
                let found = files(folder.path());
                assert!(!found.keys().any(|name| is_temporary(name)), "{blocks}: {:?}", found.keys());
                let count = assert_whole(folder.path(), &new, old, &format!("{blocks} blocks"));
                if output.status.success() {
                    assert_eq!(count, new.len());
                } else {
                    assert_failed(&output, "File too large");
                    assert!(count == 0 && found.len() == if old { new.len() } else { 0 }, "{blocks}");
                    failed += 1;
                }
            }
        }
        assert_eq!(failed, 12);
    }
}

mod folders {
    use super::*;

    /// Starts the command, does something to the folder while it waits for the scene, and lets it go on.
    fn meanwhile(folder: &Path, arguments: &str, what: impl FnOnce()) -> Output {
        let mut child = start(folder, arguments);
        wait_for_the_scene(&mut child);
        what();
        finish(child)
    }

    #[test]
    fn that_vanish_while_it_renders_are_an_error_of_one_line() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().join("gone");
        fs::create_dir(&folder).unwrap();
        let arguments = "render /dev/stdin -o gone/out.png --dump dump --size 8x8";
        let output = meanwhile(outer.path(), arguments, || fs::remove_dir(&folder).unwrap());
        assert_failed(&output, "the folder gone does not exist");
        assert!(files(outer.path()).is_empty() && !outer.path().join("dump").exists());
    }

    #[test]
    fn that_take_the_files_place_while_it_renders_are_an_error_of_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let output = meanwhile(folder.path(), "render /dev/stdin -o out.png --dump dump --size 8x8", || {
            fs::create_dir(folder.path().join("out.png")).unwrap();
        });
        assert_failed(&output, "it is a folder");
        let output = meanwhile(folder.path(), "render /dev/stdin -o a.png --dump dump --size 8x8", || {
            fs::write(folder.path().join("dump"), OLD).unwrap();
        });
        assert_failed(&output, "it is a file, where a folder is wanted");
        assert_eq!(files(folder.path()).into_keys().collect::<Vec<_>>(), ["dump"]);
    }

    /// The folder vanishes when the files are written but do not have their names yet. Only a kill or a pipe makes this
    /// moment long enough.
    #[test]
    fn that_vanish_before_the_files_have_their_names_are_an_error_of_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("out.png");
        make_fifo(&pipe);
        let mut child = start(folder.path(), &format!("{DUMP} --size 8x8"));
        child.stdin.take().unwrap().write_all(SCENE.as_bytes()).unwrap();
        wait_until(&mut child, || staged(folder.path()) == 8);
        fs::remove_dir_all(folder.path().join("dump")).unwrap();
        // When the pipe is read, the command continues.
        let picture = fs::read(&pipe).unwrap();
        assert!(image::load_from_memory(&picture).is_ok());
        let output = child.wait_with_output().unwrap();
        assert_failed(&output, "cannot write dump/");
        assert!(files(folder.path()).is_empty(), "{:?}", files(folder.path()).keys());
    }
}

mod places {
    use super::*;

    #[test]
    fn that_are_links_keep_the_link_and_replace_what_it_leads_to() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("elsewhere")).unwrap();
        fs::write(at("elsewhere/file.png"), OLD).unwrap();
        symlink("elsewhere/file.png", at("link.png")).unwrap();
        symlink("elsewhere/new.png", at("dangling.png")).unwrap();
        symlink("nowhere/new.png", at("lost.png")).unwrap();
        symlink("loop.png", at("loop.png")).unwrap();
        symlink("elsewhere", at("folder.png")).unwrap();
        symlink("/dev/full", at("full.png")).unwrap();
        for (name, leads_to) in [("link.png", "elsewhere/file.png"), ("dangling.png", "elsewhere/new.png")] {
            let output = run(folder.path(), &format!("render /dev/stdin -o {name} --size 8x8"));
            assert!(output.status.success(), "{:?}", said(&output));
            assert_eq!(fs::read_link(at(name)).unwrap().to_str(), Some(leads_to));
            image::open(at(leads_to)).unwrap();
        }
        let before = files(folder.path());
        for (name, part) in [
            ("lost.png", "does not exist"),
            ("loop.png", "symbolic links"),
            ("folder.png", "it is a folder"),
            ("full.png", "No space left on device"),
        ] {
            assert_failed(&run(folder.path(), &format!("render /dev/stdin -o {name} --dump dump --size 8x8")), part);
            assert!(files(folder.path()) == before && !at("dump").exists(), "{name}");
        }
    }

    #[test]
    fn that_are_pipes_get_the_bytes_and_stay_pipes() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("out.png");
        make_fifo(&pipe);
        let child = start(folder.path(), "render /dev/stdin -o out.png --size 64x48");
        let reader = std::thread::spawn(move || fs::read(pipe).unwrap());
        let output = finish(child);
        assert!(output.status.success(), "{:?}", said(&output));
        assert_eq!(image::load_from_memory(&reader.join().unwrap()).unwrap().width(), 64);

        // This reader leaves in the middle of a file that is larger than the pipe's buffer.
        fs::rename(folder.path().join("out.png"), folder.path().join("out.exr")).unwrap();
        let arguments = "render cornell-box -o out.exr --show depth --dump dump --size 640x480";
        let child = start(folder.path(), arguments);
        let mut reader = fs::File::open(folder.path().join("out.exr")).unwrap();
        reader.read_exact(&mut [0; 8]).unwrap();
        drop(reader);
        assert_failed(&child.wait_with_output().unwrap(), "Broken pipe");
        assert!(files(folder.path()).is_empty() && !folder.path().join("dump").exists());
    }
}

mod streams {
    use super::*;

    /// Verbs that print, with as little work as possible, and whether they fail.
    const VERBS: [(&str, bool); 6] = [
        ("render /dev/null -o a.png", true),
        ("render cornell-box --size 8x8 -o a.png", false),
        ("info", false),
        ("truth --size 8x6 --truth-rays 2 -o t.exr", false),
        ("bench cornell-box --size 8x6 --runs 1 --only figure1", false),
        ("tune nave --size 24x18 --max-error 0.5 --method ssao --truth-rays 2 --runs 1 -o t.toml", false),
    ];

    fn in_shell(folder: &Path, arguments: &str, redirection: &str) -> Output {
        let mut shell = with_pipes(by("sh", folder));
        shell.args(["-c", &format!("\"$0\" \"$@\" {redirection}"), HBAO]).args(arguments.split_whitespace());
        shell.stdin(Stdio::null()).output().unwrap()
    }

    #[test]
    fn that_are_closed_are_no_panic() {
        for (verb, fails) in VERBS {
            for redirection in [">&-", "2>&-", "<&-", "<&- >&- 2>&-"] {
                let folder = tempfile::tempdir().unwrap();
                let output = in_shell(folder.path(), verb, redirection);
                said(&output);
                assert_eq!(output.status.code(), Some(i32::from(fails)), "{verb} {redirection}: {:?}", said(&output));
                assert!(!files(folder.path()).keys().any(|name| is_temporary(name)));
            }
        }
    }

    #[test]
    fn whose_reader_has_left_are_no_panic() {
        for (verb, fails) in VERBS {
            let folder = tempfile::tempdir().unwrap();
            let (reader, writer) = io::pipe().unwrap();
            drop(reader);
            let mut all = with_pipes(hbao(folder.path(), verb));
            let status = all.stdin(Stdio::null()).stdout(writer.try_clone().unwrap()).stderr(writer).status().unwrap();
            assert_eq!(status.code(), Some(i32::from(fails)), "{verb}");
        }
    }

    #[test]
    fn that_are_full_are_an_error_where_a_result_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        for verb in ["info", "--help", "bench cornell-box --size 8x6 --runs 1 --only figure1"] {
            assert_failed(&in_shell(folder.path(), verb, ">/dev/full"), "cannot write standard output: No space left");
        }
        // Messages are not the result, so losing them is no error.
        let output = in_shell(folder.path(), "render --size 8x8 -o a.png", "2>/dev/full");
        assert!(output.status.success() && folder.path().join("a.png").exists());
    }
}

#[test]
fn without_any_opengl_library_it_fails_in_one_line_and_leaves_nothing() {
    let libraries = tempfile::tempdir().unwrap();
    for library in ["libEGL.so.1", "libEGL.so", "libOSMesa.so.8"] {
        fs::write(libraries.path().join(library), "no library").unwrap();
    }
    for backend in ["auto", "egl", "osmesa"] {
        let folder = tempfile::tempdir().unwrap();
        let mut all = with_pipes(hbao(folder.path(), &format!("{DUMP} --backend {backend}")));
        let output = finish(all.env("LD_LIBRARY_PATH", libraries.path()).spawn().unwrap());
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && text.lines().count() == 1, "{text}");
        let named = if backend == "egl" { "libEGL" } else { "libOSMesa" };
        assert!(text.starts_with("hbao: ") && text.contains(named), "{text}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
