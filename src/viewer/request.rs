//! Writes what the window shows as the arguments of `hbao render`.

use super::eye::Eye;
use hbao::context::Backend;
use hbao::scene::Scene;
use hbao::settings::{KNOBS, Kind, Radius, Settings};
use std::ffi::{OsStr, OsString};

/// The settings that `hbao render` has for this scene and method if no flag gives others.
pub(super) fn defaults(settings: &Settings, scene: &Scene) -> Settings {
    let own = Settings::for_scene(settings.method);
    Settings { radius: scene.radius.map_or(own.radius, Radius::Units), ..own }
}

/// The command that renders an image: everything but the file that it is written to.
pub(super) struct Rendered<'a> {
    pub(super) name: &'a OsStr,
    pub(super) scene: &'a Scene,
    pub(super) eye: &'a Eye,
    pub(super) settings: &'a Settings,
    pub(super) show: &'a str,
    pub(super) size: (u32, u32),
    pub(super) backend: Backend,
}

impl Rendered<'_> {
    /// The arguments of the program, from the verb on. Settings that are the defaults are left out.
    pub(super) fn arguments(&self, output: &OsStr) -> Vec<OsString> {
        let mut words: Vec<OsString> = vec!["render".into()];
        let Rendered { settings, size: (width, height), .. } = self;
        let mut flag = |name: &str, value: &str| words.extend([name.into(), value.into()]);
        flag("--size", &format!("{width}x{height}"));
        self.eye.flags().iter().for_each(|(name, value)| flag(name, value));
        if self.show != "final" {
            flag("--show", self.show);
        }
        if self.backend != Backend::Auto {
            flag("--backend", self.backend.name());
        }
        let usual = defaults(settings, self.scene);
        let own = Settings::default().method;
        for knob in KNOBS {
            let (text, usual) = (knob.text(settings), knob.text(&usual));
            let differs = if knob.name == "method" { settings.method != own } else { text != usual };
            match knob.kind {
                _ if !differs => {}
                // A switch takes its value after an equals sign only.
                Kind::Switch => words.push(format!("--{}={text}", knob.name).into()),
                _ => words.extend([format!("--{}", knob.name).into(), text.into()]),
            }
        }
        words.extend(["-o".into(), output.into()]);
        // A scene whose name begins with a minus is no flag.
        if self.name.to_string_lossy().starts_with('-') {
            words.push("--".into());
        }
        words.push(self.name.into());
        words
    }
}

/// Writes a command for a shell, with quotes where they are needed.
pub(super) fn line(arguments: &[OsString]) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=%+:@".contains(c);
    let word = |word: &OsString| match word.to_string_lossy() {
        word if !word.is_empty() && word.chars().all(plain) => word.into_owned(),
        word => format!("'{}'", word.replace('\'', "'\\''")),
    };
    ["hbao".to_string()].into_iter().chain(arguments.iter().map(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use hbao::scene::CORNELL_BOX;
    use hbao::settings::{Knob, Method};

    fn of(settings: &Settings, name: &str) -> String {
        let scene = Scene::open(CORNELL_BOX).unwrap();
        let eye = Eye::new(&scene.view, &scene.mesh, (64, 48)).unwrap();
        let (show, size, backend) = ("ao", (64, 48), Backend::Auto);
        let rendered = Rendered { name: name.as_ref(), scene: &scene, eye: &eye, settings, show, size, backend };
        line(&rendered.arguments("a.png".as_ref()))
    }

    #[test]
    fn only_what_differs_is_written() {
        let scene = Scene::open(CORNELL_BOX).unwrap();
        let usual = defaults(&Settings::for_scene(Method::HbaoTalk), &scene);
        let text = of(&usual, CORNELL_BOX);
        assert!(text.starts_with("hbao render --size 64x48 --eye 278,273,-800 "), "{text}");
        assert!(text.ends_with(" --show ao --method hbao-talk -o a.png cornell-box"), "{text}");
        let mut changed = usual;
        for (name, value) in [("radius", "7%"), ("half-res", "true"), ("bias", "30"), ("attenuation", "none")] {
            Knob::named(name).unwrap().set(&mut changed, value).unwrap();
        }
        let text = of(&changed, CORNELL_BOX);
        let expected = "--method hbao-talk --radius 7% --bias 30.0 --attenuation none --half-res=true -o";
        assert!(text.contains(expected), "{text}");
    }

    #[test]
    fn names_are_quoted_for_a_shell() {
        let settings = Settings::default();
        assert!(of(&settings, "it's a.obj").ends_with(r" 'it'\''s a.obj'"));
        assert!(of(&settings, "-a.obj").ends_with(" -- -a.obj"));
    }
}
