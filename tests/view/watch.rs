//! A model whose files change is read again.

use crate::Window;

const MODEL: &str =
    "mtllib step.mtl\nv 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 0 4\nv 0 3 0\nv 4 3 0\nusemtl a\nf 1 2 3 4\nf 1 2 6 5\n";

#[test]
fn a_model_that_changes_is_read_again_under_the_same_camera() {
    let Some(mut window) = Window::open("") else { return };
    std::fs::write(window.path("step.mtl"), "newmtl a\nKd 1 1 1\n").unwrap();
    std::fs::write(window.path("step.obj"), MODEL).unwrap();
    window.write("field open", "step.obj");
    window.click("open");
    let opened = window.settled(|line| line["scene"] == "step.obj");
    window.drag("image", [0.5, 0.5], [0.6, 0.6]);
    let turned = window.settled(|line| line["command"] != opened["command"]);

    // A bad file is a message, and the scene stays.
    std::fs::write(window.path("step.obj"), "v 0 0\n").unwrap();
    window.wait(|line| line["message"].as_str().is_some_and(|message| message.contains("step.obj")));
    let same = window.settled(|_| true);
    assert_eq!(same["image"]["hash"], turned["image"]["hash"]);

    // A good one takes the message away.
    let taller = MODEL.replace(" 3 ", " 2 ");
    std::fs::write(window.path("step.obj"), taller).unwrap();
    let changed = window.settled(|line| line["image"]["hash"] != turned["image"]["hash"]);
    assert!(changed["message"].is_null());
    assert_eq!(changed["command"], turned["command"]);
    assert_eq!(changed["said"], "step.obj has changed, and was read again.");

    std::fs::write(window.path("step.mtl"), "newmtl a\nKd 0.2 0.5 0.3\n").unwrap();
    let coloured = window.settled(|line| line["image"]["hash"] != changed["image"]["hash"]);
    assert_eq!(coloured["command"], turned["command"]);
    window.close();
}
