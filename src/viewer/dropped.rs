//! Tests that files which are dropped on the window are opened. No tool drops files on a window under Xvfb.

use super::state::{Start, Viewer};
use super::worker::Worker;
use eframe::egui;
use hbao::context::{Backend, Context};
use hbao::scene::Scene;
use hbao::settings::Settings;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// A file that was dropped on the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

/// A viewer without a window.
fn viewer() -> Viewer {
    let open = Box::new(|| Context::open(Backend::Auto));
    let scene = Scene::open(hbao::scene::CORNELL_BOX).unwrap();
    Viewer::new(Start {
        worker: Worker::start(open, |_, _| Ok(()), None).unwrap(),
        name: hbao::scene::CORNELL_BOX.into(),
        view: scene.view.clone(),
        scene,
        settings: Settings::default(),
        backend: Backend::Auto,
        size: (64, 48),
        wanted: None,
        log: None,
        start: Instant::now(),
    })
    .unwrap()
}

#[test]
fn a_model_that_is_dropped_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("step.obj");
    std::fs::write(&path, "v 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 3 0\nf 1 2 3\nf 1 2 4\n").unwrap();
    let mut viewer = viewer();
    let context = egui::Context::default();
    let input = egui::RawInput { dropped_files: vec![Arc::new(Dropped(path.clone()))], ..Default::default() };
    context.run_ui(input, |ui| viewer.take_dropped(ui.ctx())).textures_delta.clear();
    let start = Instant::now();
    while viewer.name != path.as_os_str() {
        viewer.take_answers(&context);
        assert!(viewer.message.is_none() && start.elapsed().as_secs() < 60, "{:?}", viewer.message);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(viewer.scene.mesh.triangles.len(), 2);
}
