//! `hbao sequence`: renders many frames of one scene along a camera path, so that an interrupted run goes on where it
//! was, and several machines can share the work.

mod frames;
mod motion;
mod worker;

use super::flags::{self, Flags};
use super::render::APPLY;
use super::session::limit_threads;
use crate::picture::{self, FileFormat};
use crate::terminal::{bar, say};
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use frames::Names;
use hbao::image::Outputs;
use hbao::scene::NOTHING_IN_VIEW;
use hbao::settings::Settings;
use hbao::{Apply, Error};
use motion::Motion;
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::AtomicUsize;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Instant;
use worker::{Done, Work};

/// The largest number of contexts that render side by side.
const MOST_CONTEXTS: usize = 64;

/// The longest line of a log that is read, in bytes.
const LONGEST_LINE: u64 = 1 << 20;

const EXPLANATION: &str = "\
A path is JSON, {\"fps\": 24, \"interpolation\": \"catmull-rom\", \"keys\": [{\"time\": 0, \"eye\": [0,1,5], \"target\": [0,1,0],
\"up\": [0,1,0], \"fov_y\": 50}, ...]} with times in seconds and angles in degrees (fps, interpolation, up and fov_y may be
left out), or CSV with the header time,eye_x,eye_y,eye_z,target_x,target_y,target_z[,up_x,up_y,up_z][,fov_y]. Frame i
stands at the time i / fps, and i is the number in its file's name. Without a path and without --turntable, --camera
names a camera of a glTF file that an animation moves, of which the flags may change the lens and the planes alone.

A frame that exists is not rendered again if its metadata say that it shows the same: the settings, the camera, the
contents of the scene, the driver. So a run that was interrupted goes on when the same command is given again, and after
a change of the scene only what it changes is rendered. With --no-metadata all frames are rendered. With --truth-rays
and --log, a frame whose error the log lacks is rendered and traced again.

--chunk lets the machines of a farm share the frames: each renders one part.

Examples:
  hbao sequence nave --path walk.json -o 'walk.####.png'
  hbao sequence model.obj --turntable 100 -o 'turn.####.png' --size 640x480
  hbao sequence model.obj --turntable 100 -o 'turn.####.png' --frames 0-99,10 --show ao
  hbao sequence nave --path walk.json -o 'walk.####.png' --chunk $SLURM_ARRAY_TASK_ID/8
  ffmpeg -framerate 24 -i walk.%04d.png -pix_fmt yuv420p walk.mp4";

/// Makes the verb's flags.
pub(crate) fn command() -> Command {
    let shows = picture::names().map(|(name, _)| name).collect::<Vec<_>>().join(", ");
    let applies = APPLY.map(|(name, _)| name).join(", ");
    let output = Arg::new("output").short('o').long("output").value_name("OUT").required(true);
    let output = output.value_parser(value_parser!(PathBuf)).action(ArgAction::Set);
    let outputs = [
        output.help("The frames to write, such as frame.####.png or frame.####.exr; #### becomes the frame's number"),
        flags::valued("show", "IMAGE", format!("The image of each frame, as of hbao render [{shows}; default: final]")),
        flags::valued("apply", "PART", format!("The light that ambient occlusion darkens [{applies}; default: all]")),
        flags::path(
            "log",
            "FILE",
            "Append a line of JSON for each frame: its file, its time, its share of early exits",
        ),
        flags::truth_rays().help(
            "Trace each frame too, with N rays per pixel, and log the RMSE of its ambient occlusion [even, 2 to 65536; \
             default: no truth]",
        ),
        flags::valued("contexts", "N", "OpenGL contexts that render side by side [1 to 64; default: 1]"),
        flags::no_metadata(),
    ];
    let heading = |heading: &'static str| move |arg: Arg| arg.help_heading(heading);
    Command::new("sequence")
        .about("Render many frames of a scene along a camera path")
        .args(outputs.map(heading("Output")))
        .args(motion::arguments().map(heading("Camera")))
        .args(frames::arguments().map(heading("Output")))
        .args(flags::arguments())
        .after_help(EXPLANATION)
}

/// Renders the frames, and reports what became of them.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    let flags = Flags::read(matches)?;
    let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
    let names = Names::read(&output)?;
    let format = FileFormat::of(&output)?;
    let images: Vec<_> = picture::names().collect();
    let show = flags::word("show", flags::text(matches, "show").unwrap_or("final"), &images)?;
    let apply: Apply = flags::word("apply", flags::text(matches, "apply").unwrap_or("all"), &APPLY)?;
    let rays = flags::text(matches, "truth-rays").map(|_| flags::read_truth_rays(matches)).transpose()?;
    let contexts = read_contexts(matches)?;
    let opened = Motion::is_of_camera(matches)?.then(|| flags.open_scene()).transpose()?;
    let motion = match &opened {
        Some((scene, _)) => {
            // A notice may tell why the camera stands still.
            scene.notices.iter().for_each(|notice| say(notice));
            Motion::of_camera(matches, scene)?
        }
        None => Motion::read(matches)?,
    };
    if motion.has_lens() && flags.view.lens.is_some() {
        let what = "--path tells the field of view, fov_y: leave out --fov-y, --ortho, --frustum, --ortho-frustum, \
                    --intrinsics and --projection, or fov_y";
        return Err(Error::Usage(what.into()));
    }
    let chosen = frames::read(matches, motion.frames())?;
    motion.check(&chosen)?;
    let (Some(&first), Some(&last)) = (chosen.first(), chosen.last()) else {
        say("no frame is in this chunk: there are more chunks than frames");
        return Ok(());
    };
    if Outputs::is_stream(names.of(first)) {
        let what = "frames must be files, each with a name of its own";
        return Err(Error::Usage(format!("--output {}: {what}", output.display())));
    }
    Outputs::check([names.of(first)])?;
    let mut log = matches.get_one::<PathBuf>("log").map(|path| open_log(path)).transpose()?;
    let traced = log.as_mut().map(Log::traced).transpose()?.unwrap_or_default();

    let told = opened.is_some();
    let (scene, settings) = opened.map_or_else(|| flags.open_scene(), Ok)?;
    flags.notices.iter().chain(scene.notices.iter().filter(|_| !told)).for_each(|notice| say(notice));
    let request = picture::request([show], apply);
    if rays.is_some() && request.gbuffer_only {
        say("--truth-rays has no effect: this image holds no ambient occlusion");
    } else if rays.is_some() && log.is_none() {
        say("--truth-rays has no effect without --log, the file that gets the errors");
    }
    for flag in flags.knobs_given().filter(|flag| !show.is_decided_by(flag, &settings)) {
        let why = settings.idle(flag).map_or_else(|| "on this image".into(), |idle| idle.to_string());
        say(&format!("--{flag} has no effect {why}"));
    }
    let given = flags.view.or(&scene.view);
    let views = motion.views(&given, &scene.view, &scene.mesh, flags.size)?;
    let resolved = settings.resolved(scene.mesh.diagonal());
    let work = Work {
        flags: &flags,
        scene: &scene,
        settings: &settings,
        resolved: Settings { blur: if show.is_unblurred() { 0 } else { settings.blur }, ..resolved },
        show,
        apply,
        request,
        format,
        names: &names,
        rays: rays.filter(|_| !request.gbuffer_only && log.is_some()),
        tracer: OnceLock::new(),
        traced,
        contents: (!matches.get_flag("no-metadata")).then(|| scene.mesh.sha256()),
        view: &views,
        frames: &chosen,
        next: AtomicUsize::new(0),
    };
    let start = Instant::now();
    let contexts = contexts.min(chosen.len());
    share_threads(contexts);
    let progress = bar(chosen.len() as u64, "frames");
    let mut told = Told::default();
    let (mut rendered, mut failed) = (0_usize, None);
    thread::scope(|scope| {
        let (done, finished) = channel();
        let start = |index| {
            let (work, done) = (&work, done.clone());
            scope.spawn(move || work.run(index == 0, &done))
        };
        let workers: Vec<_> = (0..contexts).map(start).collect();
        drop(done);
        for result in finished {
            match result {
                Ok(frame) => {
                    progress.inc(1);
                    rendered += usize::from(frame.rendered);
                    told.take(&frame);
                    let logged = log.as_mut().map_or(Ok(()), |log| log.write(&frame));
                    if let Err(error) = logged {
                        work.stop();
                        failed.get_or_insert(error);
                    }
                }
                // The frames that are being rendered are finished; no other is begun.
                Err(error) => {
                    work.stop();
                    failed.get_or_insert(error);
                }
            }
        }
        // The end of the scope does not wait for what Mesa does at the end of a thread, and the end of the process must
        // not run into that.
        workers.into_iter().for_each(|worker| {
            if let Err(panic) = worker.join() {
                std::panic::resume_unwind(panic);
            }
        });
    });
    progress.finish_and_clear();
    if let Some(error) = failed {
        return Err(error);
    }
    told.say(chosen.len());
    let after = names.of(motion.frames().end().saturating_add(1));
    if after.exists() {
        say(&format!("{} is no frame of this motion: an earlier one may have had more frames", after.display()));
    }
    let seconds = start.elapsed().as_secs_f64();
    say(&format!(
        "frames {first} to {last}: {rendered} rendered, {:.2} per second; {} were there already",
        rendered as f64 / seconds,
        chosen.len() - rendered
    ));
    Ok(())
}

fn read_contexts(matches: &ArgMatches) -> Result<usize, Error> {
    let Some(given) = flags::text(matches, "contexts") else { return Ok(1) };
    let contexts = given.parse().ok().filter(|contexts| (1..=MOST_CONTEXTS).contains(contexts));
    contexts
        .ok_or_else(|| Error::Usage(format!("--contexts: '{given}' is not a whole number from 1 to {MOST_CONTEXTS}")))
}

/// Gives each of several contexts its share of the cores, unless the environment says how many threads llvmpipe takes.
fn share_threads(contexts: usize) {
    limit_threads();
    if contexts > 1 && std::env::var_os("LP_NUM_THREADS").is_none() {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        // SAFETY: no driver has been loaded, so that all threads of this process run Rust code only. It reads the
        // environment under the lock that this function takes.
        unsafe { std::env::set_var("LP_NUM_THREADS", (cores / contexts).max(1).to_string()) };
    }
}

/// The file of `--log`.
struct Log {
    path: PathBuf,
    file: File,
}

fn open_log(path: &std::path::Path) -> Result<Log, Error> {
    let file = File::options().read(true).create(true).append(true).open(path);
    let file = file.map_err(|e| Error::Output { path: path.into(), what: e.to_string() })?;
    Ok(Log { path: path.into(), file })
}

impl Log {
    /// Returns what the lines of earlier runs say was traced. A line that was cut short is ended.
    fn traced(&mut self) -> Result<HashSet<String>, Error> {
        let mut traced = HashSet::new();
        let mut read = || {
            let mut text = Vec::new();
            // A log that cannot be read again, such as a pipe, has none.
            if !self.file.metadata()?.is_file() {
                return Ok(());
            }
            let mut lines = BufReader::new(&self.file);
            while lines.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut text)? > 0 {
                let line = serde_json::from_slice::<Value>(&text).unwrap_or_default();
                traced.extend(line["traced"].as_str().map(String::from));
                if !text.ends_with(b"\n") && text.len() < LONGEST_LINE as usize {
                    (&self.file).write_all(b"\n")?;
                }
                text.clear();
            }
            Ok(())
        };
        let read: std::io::Result<()> = read();
        read.map_err(|e| Error::Output { path: self.path.clone(), what: e.to_string() })?;
        Ok(traced)
    }

    /// Appends the line of a frame.
    fn write(&mut self, done: &Done) -> Result<(), Error> {
        let mut line = json!({
            "frame": done.frame,
            "file": done.path.to_string_lossy(),
            "rendered": done.rendered,
            "seconds": done.seconds,
        });
        if let Some(exits) = done.exits {
            line["early_exits"] = json!(exits);
        }
        if let Some((rmse, noise)) = done.error {
            line["rmse"] = json!(rmse);
            line["noise_rmse"] = json!(noise);
        }
        if let Some(traced) = &done.traced {
            line["traced"] = json!(traced);
        }
        let written = self.file.write_all(format!("{line}\n").as_bytes());
        written.map_err(|e| Error::Output { path: self.path.clone(), what: e.to_string() })
    }
}

/// The notices of all frames. One that many frames have is said once.
#[derive(Default)]
struct Told(BTreeMap<String, (usize, u32, String)>);

impl Told {
    fn take(&mut self, done: &Done) {
        for notice in &done.notices {
            // Notices that differ only in their numbers are of one kind.
            let kind = notice.replace(|c: char| c.is_ascii_digit() || c == '.', "");
            let entry = self.0.entry(kind).or_insert((0, done.frame, notice.clone()));
            entry.0 += 1;
            if done.frame < entry.1 {
                (entry.1, entry.2) = (done.frame, notice.clone());
            }
        }
    }

    fn say(&self, frames: usize) {
        for (count, first, notice) in self.0.values() {
            say(&format!("in {count} of {frames} frames, the first is frame {first}: {notice}"));
        }
    }
}

/// The notice for a frame in which no pixel holds a surface.
fn nothing() -> String {
    format!("{NOTHING_IN_VIEW}: no part of the scene lies in the picture")
}
