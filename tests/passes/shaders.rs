//! Every shader must be GLSL 3.30 core according to Khronos's reference compiler, which is stricter than drivers are.
//!
//! The tests need `glslangValidator` (Debian: glslang-tools). If it is missing, they report that and pass, unless
//! `HBAO_REQUIRE_TOOLS=1` is set, as it is in continuous integration. They check the text that the library gives to the
//! driver, which Mesa writes into the directory named by `MESA_SHADER_DUMP_PATH`.

use crate::output::{KINDS, texture};
use crate::rig;
use crate::rig::by_hand::{ByHand, Textures, orthographic, perspective};
use crate::rig::process::in_own_process;
use crate::rig::stored::{Depths, Stored};
use crate::rig::{every_switch, scenes};
use glow::HasContext as _;
use hbao::context::{Backend, Context};
use hbao::image::Image;
use hbao::scene::Projection;
use hbao::settings::{Method, Radius};
use hbao::{
    AmbientOcclusion, Apply, DepthEncoding, Destination, Hand, Inputs, NormalEncoding, NormalSpace, Output,
    TextureTarget, Viewport, Write,
};
use std::ffi::OsStr;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// False if the compiler is missing and not required.
fn compiler_is_there() -> bool {
    if Command::new("glslangValidator").arg("--version").output().is_ok() {
        return true;
    }
    let required = std::env::var_os("HBAO_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    assert!(!required, "HBAO_REQUIRE_TOOLS is set, but glslangValidator is missing: install glslang-tools");
    // The harness would capture what `eprintln!` writes, and nobody would see it.
    let skipped = "SKIPPED: no glslangValidator (Debian: glslang-tools), so no shader is checked against GLSL 3.30";
    let _ = writeln!(std::io::stderr(), "{skipped}");
    false
}

/// Returns the compiler's error messages for these files, which are named .vert and .frag.
fn complaints(files: &[PathBuf]) -> Result<(), String> {
    let output = Command::new("glslangValidator").args(files).output().unwrap();
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stdout).into_owned()) }
}

/// The variable by which Mesa chooses its driver, and the name of the driver that interprets shaders.
const DRIVER: (&str, &str) = ("GALLIUM_DRIVER", "softpipe");

/// Makes the library compile all its shaders, for settings that use every switch. llvmpipe compiles the pipeline's
/// shaders, some of which need several samples per pixel. The shaders for an application's own textures have the same
/// text on every driver. softpipe compiles those, because it does so many times faster.
fn compile_everything() {
    if std::env::var_os(DRIVER.0).is_some_and(|driver| driver == DRIVER.1) {
        compile_for_all_textures();
    } else {
        compile_pipelines();
    }
}

fn compile_pipelines() {
    let context = Context::open(Backend::Osmesa).unwrap();
    let gl = context.gl();
    let size = (3, 2);
    for (i, settings) in every_switch().iter().enumerate() {
        for shot in [scenes::cornell_box(), scenes::cornell_box().orthographic()] {
            let apply = if i % 2 == 0 { Apply::All } else { Apply::Ambient };
            rig::render_applied(gl, &shot, size, settings, apply);
        }
    }
    for (directions, steps, blur) in [(1, 1, 3), (64, 256, 41)] {
        let settings = hbao::Settings { directions, steps, blur, ..every_switch()[1].clone() };
        rig::render(gl, &scenes::cornell_box(), size, &settings);
    }
}

fn compile_for_all_textures() {
    let context = Context::open(Backend::Osmesa).unwrap();
    assert!(context.describe().contains(DRIVER.1), "{}", context.describe());
    for projection in [perspective(60.0, (3, 2)), orthographic(1.0, (3, 2))] {
        // The pipeline covers the switches of the chapter's method, so its first settings are enough here.
        let others = every_switch().into_iter().filter(|settings| settings.method != Method::Hbao);
        for settings in others.chain([every_switch()[0].clone()]) {
            compile_for_textures(context.gl(), projection, &settings);
        }
    }
}

fn compile_for_textures(gl: &std::sync::Arc<glow::Context>, projection: Projection, settings: &hbao::Settings) {
    let view = ByHand { depth: Image::filled(3, 2, 1.0), normals: Image::filled(3, 2, [0.0, 0.0, -1.0]), projection };
    let settings = hbao::Settings { radius: Radius::Units(1.0), ..settings.clone() };
    for make in [AmbientOcclusion::new, AmbientOcclusion::fetch_floor] {
        let mut ao = make(gl.clone(), view.size(), &settings).unwrap();
        for target in [TextureTarget::Rectangle, TextureTarget::Texture2d] {
            for encoding in [NormalEncoding::Signed, NormalEncoding::Biased] {
                Textures::new(gl, &view, target, encoding).visibility(&mut ao, &view);
            }
        }
        compile_for_inputs(gl, &view, &mut ao);
    }
}

/// Compiles the shaders for depth buffers of every convention, for layers and viewports, and for normals of every space
/// and encoding.
fn compile_for_inputs(gl: &std::sync::Arc<glow::Context>, view: &ByHand, ao: &mut AmbientOcclusion) {
    let textures = Textures::new(gl, view, TextureTarget::Texture2d, NormalEncoding::Signed);
    let whole = textures.inputs;
    let conventions = [
        DepthEncoding::standard(0.1, 10.0),
        DepthEncoding::reversed(0.1, 10.0),
        DepthEncoding::Logarithmic { c: 1.0, far: 10.0 },
    ];
    for encoding in conventions {
        let stored = Stored::new(gl, view, encoding, Depths::Float, TextureTarget::Layer(1));
        let inputs = Inputs { depth: stored.image, depth_encoding: encoding, normals: None, ..whole };
        ao.render(&inputs).unwrap();
        ao.diagnose(&inputs).unwrap();
    }
    let viewport = Some(Viewport { x: 0, y: 0, width: 3, height: 2 });
    for normal_encoding in [NormalEncoding::Octahedral, NormalEncoding::OctahedralBiased] {
        let inputs = Inputs { normal_encoding, normal_space: NormalSpace::Eye(Hand::Right), viewport, ..whole };
        ao.render(&inputs).unwrap();
        ao.diagnose(&inputs).unwrap();
    }
    compile_for_outputs(gl, &textures, ao);
}

/// Compiles the pass that writes to an application's images, for shares of ambient light in every kind of texture.
fn compile_for_outputs(gl: &std::sync::Arc<glow::Context>, textures: &Textures, ao: &mut AmbientOcclusion) {
    let image = |target| texture(gl, target, (3, 2), |_, _| [1.0; 4]);
    // SAFETY: the context is current.
    let samples = unsafe { gl.get_parameter_i32(glow::MAX_COLOR_TEXTURE_SAMPLES) };
    let kinds = KINDS.into_iter().filter(|kind| samples >= 4 || !matches!(kind, TextureTarget::Multisample(_)));
    for write in kinds.map(|kind| Write::MultipliedByShare(image(kind))).chain([Write::Visibility]) {
        let to = Destination::Texture(image(TextureTarget::Rectangle));
        ao.render_into(&textures.inputs, &Output::new(to, write)).unwrap();
    }
}

/// Copies the dumped shaders to file names that show their stage. Returns these names and the texts.
fn named_by_stage(dump: &Path, into: &Path) -> Vec<(PathBuf, String)> {
    let mut shaders = Vec::new();
    for entry in std::fs::read_dir(dump).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let stage = if stem.starts_with("VS_") { "vert" } else { "frag" };
        let text = std::fs::read_to_string(&path).unwrap();
        let copy = into.join(format!("{stem}.{stage}"));
        std::fs::write(&copy, &text).unwrap();
        shaders.push((copy, text));
    }
    shaders
}

#[test]
fn every_shader_is_glsl_3_30_core_and_an_error_planted_in_any_is_caught() {
    const TEST: &str = "every_shader_is_glsl_3_30_core_and_an_error_planted_in_any_is_caught";
    if !compiler_is_there() {
        return;
    }
    let (dump, copies) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let dumped = ("MESA_SHADER_DUMP_PATH", dump.path().as_os_str());
    in_own_process(TEST, &[dumped], compile_everything);
    if std::env::var_os("HBAO_TEST_CHILD").is_some() {
        return;
    }
    in_own_process(TEST, &[dumped, (DRIVER.0, OsStr::new(DRIVER.1))], compile_everything);
    let shaders = named_by_stage(dump.path(), copies.path());
    // The whole text of each file in glsl/ must be part of some shader.
    let glsl = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    for folder in [glsl.clone(), glsl.join("shared")] {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                let text = std::fs::read_to_string(&path).unwrap();
                assert!(shaders.iter().any(|(_, shader)| shader.contains(&text)), "{} is in no shader", path.display());
            }
        }
    }
    assert!(shaders.len() > 40, "{} shaders", shaders.len());
    for (path, text) in &shaders {
        assert!(text.starts_with("#version 330 core\n"), "{}", path.display());
    }
    // The last fallback of the G-buffer writes biased normals. No driver at hand needs it, so its switch is defined
    // here.
    let gbuffers: Vec<_> =
        shaders.iter().filter(|(_, text)| text.contains("#ifdef NORMALS_BIASED\n    out_1")).collect();
    assert!(gbuffers.len() >= 4, "{} shaders of the G-buffer", gbuffers.len());
    for (path, text) in gbuffers {
        let biased = text.replacen("core\n", "core\n#define NORMALS_BIASED 1\n", 1);
        let file = path.with_file_name(format!("biased_{}", path.file_name().unwrap().to_str().unwrap()));
        std::fs::write(&file, biased).unwrap();
        complaints(&[file]).unwrap();
    }
    let paths: Vec<PathBuf> = shaders.iter().map(|(path, _)| path.clone()).collect();
    complaints(&paths).unwrap();

    // The planted errors are an undeclared name, and functions that Mesa's compilers know only from later versions.
    for plant in
        ["float planted = undeclared;", "float planted = fma(1.0, 2.0, 3.0);", "uint planted = packUnorm2x16(vec2(0));"]
    {
        let mut caught = 0;
        for (path, text) in &shaders {
            let planted = text.replacen("void main()\n{", &format!("void main()\n{{\n{plant}"), 1);
            assert_ne!(&planted, text);
            let stage = path.extension().unwrap().to_str().unwrap();
            let file = copies.path().join(format!("planted.{stage}"));
            std::fs::write(&file, planted).unwrap();
            let complaint = complaints(&[file]).expect_err(plant);
            assert!(complaint.contains("ERROR"), "{complaint}");
            caught += 1;
            // One shader would be enough. A few show that the result does not depend on that one shader.
            if caught == 4 {
                break;
            }
        }
    }
}
