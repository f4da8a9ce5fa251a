//! `hbao view`: shows a scene in a window in which its camera and all settings can be changed.

use super::flags;
use clap::{Arg, ArgMatches, Command};
use hbao::Error;

const EXPLANATION: &str = "\
The window has a panel with every setting, and shows the images of --show, one of two sets of settings or both. ? lists
its keys. Whatever it shows can be saved, and the command that renders the same image can be copied. It traces the truth
of the view, as hbao truth does, and measures each side against it while it becomes more exact (key G). A pixel that is
clicked is taken apart into its samples (key X). A model is read again when its file or its materials change.

Examples:
  hbao view
  hbao view nave --method hbao-talk
  hbao view model.obj --radius 2% --half-res";

/// Makes the verb's flags: those of `render` for the scene, the camera and the settings.
pub(crate) fn command() -> Command {
    let of_window = |arg: Arg| match arg.get_id() == "size" {
        true => arg.help("Width and height of the image in the window at the start, in pixels [default: what fits]"),
        false => arg,
    };
    let log = "Write one line of JSON for each frame that the window shows: its times, its settings, its widgets";
    Command::new("view")
        .about("Show a scene in a window, with all settings in a panel")
        .args(flags::arguments().into_iter().map(of_window))
        .arg(flags::path("log", "FILE", log).help_heading("Output"))
        .after_help(EXPLANATION)
}

/// Opens the scene, then an OpenGL context, then the window, so that what is wrong is reported before a window opens.
#[cfg(feature = "view")]
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Error> {
    use super::flags::Flags;
    use super::render;
    use super::session::open_context;
    use crate::terminal::say;
    use crate::viewer::{self, Opening};

    let flags = Flags::read(matches)?;
    let opened = flags.open()?;
    opened.notices.iter().for_each(|notice| say(notice));
    let backend = flags.backend;
    viewer::run(Opening {
        name: flags.scene.clone(),
        view: flags.view.or(&opened.scene.view),
        scene: opened.scene,
        settings: opened.settings,
        size: flags::text(matches, "size").map(|_| flags.size),
        backend,
        log: matches.get_one::<std::path::PathBuf>("log").cloned(),
        context: Box::new(move || open_context(backend)),
        render: render::run_in,
    })
}

/// Says how to get the viewer, which this program was built without.
#[cfg(not(feature = "view"))]
pub(crate) fn run(_: &ArgMatches) -> Result<(), Error> {
    Err(Error::Usage(
        "this hbao was built without its viewer: build it with cargo run --release --features view -- view".into(),
    ))
}
