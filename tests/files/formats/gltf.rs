//! glTF and GLB files as exporters write them, and hostile ones.

use super::{Noticed, Refused, Triangles, Verdict, base64, corners, hold, hold_all, open, sample};
use crate::written::{self, glb};
use glam::{DVec3, dvec3};
use hbao::scene::Lens;
use std::f64::consts::FRAC_1_SQRT_2;

const NODE: &str = r#"{"mesh":0}"#;

/// A GLB file of the sample, with these nodes and other members.
fn sample_with(nodes: &str, more: &str) -> Vec<u8> {
    let (json, binary) = written::gltf(&sample(), nodes, more, None);
    glb(&json, &binary)
}

/// A GLB file of the sample, of whose JSON a part is replaced.
fn replaced(from: &str, to: &str) -> Vec<u8> {
    let (json, binary) = written::gltf(&sample(), NODE, "", None);
    assert!(json.contains(from), "{from} of {json}");
    glb(&json.replacen(from, to, 1), &binary)
}

/// A glTF file of text with the sample, whose buffer has this URI.
fn linked(uri: &str) -> Vec<u8> {
    written::gltf(&sample(), NODE, "", Some(uri)).0.into_bytes()
}

fn binary() -> Vec<u8> {
    written::gltf(&sample(), NODE, "", None).1
}

#[test]
fn every_kind_of_gltf_file_has_its_verdict() {
    let required = |name: &str| sample_with(NODE, &format!(r#","extensionsRequired":["{name}"]"#));
    let mode = |mode: u32| replaced(r#""indices":1"#, &format!(r#""indices":1,"mode":{mode}"#));
    let good = sample_with(NODE, "");
    let chain: Vec<String> = (1..=3000).map(|i| format!(r#"{{"children":[{i}]}}"#)).collect();
    let many = format!("{}{}", r#"{"mesh":0},"#.repeat(100), NODE);
    let huge = replaced(r#""count":15"#, r#""count":18446744073709551615"#);
    let zeros =
        replaced(r#"{"bufferView":0,"componentType":5126,"count":5"#, r#"{"componentType":5126,"count":4000000000"#);
    let doubled = |what: &str| format!("[{}]", [what; 2].join(","));
    let cases: Vec<(&str, Vec<u8>, Verdict)> = vec![
        ("a GLB file", good.clone(), Triangles(5)),
        ("a data: URI", linked(&format!("data:application/octet-stream;base64,{}", base64(&binary()))), Triangles(5)),
        (
            "white space and a byte order mark before the JSON",
            [b"\xef\xbb\xbf \n".as_slice(), &linked(&format!("data:;base64,{}", base64(&binary())))].concat(),
            Triangles(5),
        ),
        ("a mesh of two nodes", sample_with(&format!("{NODE},{NODE}"), ""), Triangles(10)),
        (
            "the default scene",
            sample_with(&format!("{NODE},{NODE}"), r#","scene":1,"scenes":[{"nodes":[0,1]},{"nodes":[1]}]"#),
            Triangles(5),
        ),
        ("the first scene", sample_with(&format!("{NODE},{NODE}"), r#","scenes":[{"nodes":[0]},{}]"#), Triangles(5)),
        ("a deep tree", sample_with(&format!("{},{NODE}", chain.join(",")), ""), Triangles(5)),
        ("many nodes", sample_with(&many, ""), Triangles(505)),
        ("a strip", mode(5), Triangles(9)),
        ("a fan", mode(6), Triangles(13)),
        (
            "members that are not known",
            sample_with(NODE, r#","extras":{"a":[{}]},"extensions":{"X":{}},"animations":[{}]"#),
            Triangles(5),
        ),
        ("an extension of materials", required("KHR_materials_unlit"), Triangles(5)),
        (
            "a texture that is not there",
            replaced(r#""pbrMetallicRoughness":{"#, r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0},"#),
            Noticed(5, &["material 0: there is no texture 0; its material has the colour of baseColorFactor"]),
        ),
        ("vertex colours", replaced(r#""POSITION":0"#, r#""POSITION":0,"COLOR_0":0"#), Triangles(5)),
        (
            "vertex colours of the type SCALAR",
            replaced(r#""POSITION":0"#, r#""POSITION":0,"COLOR_0":1"#),
            Refused(&["accessor 1 is not of the type VEC3 or VEC4"]),
        ),
        (
            "a skin and morph targets",
            sample_with(r#"{"mesh":0,"skin":0},{"mesh":0,"skin":0}"#, ""),
            Noticed(10, &["skins and morph targets are not read (the first of 2"]),
        ),
        (
            "points beside triangles",
            replaced(r#""primitives":["#, r#""primitives":[{"attributes":{"POSITION":0},"mode":0},"#),
            Noticed(5, &["points and lines are not read"]),
        ),
        (
            "a primitive without positions",
            replaced(r#""primitives":["#, r#""primitives":[{"attributes":{}},"#),
            Noticed(5, &["without POSITION"]),
        ),
        (
            "a camera without a lens",
            sample_with(r#"{"mesh":0,"camera":0}"#, r#","cameras":[{"type":"perspective"}]"#),
            Noticed(5, &["node 0: its camera cannot be used"]),
        ),
        (
            "a camera of 200 degrees",
            sample_with(r#"{"mesh":0,"camera":0}"#, r#","cameras":[{"perspective":{"yfov":3.5,"znear":1}}]"#),
            Noticed(5, &["1 to 175 degrees"]),
        ),
        ("a scale of 0", sample_with(r#"{"mesh":0,"scale":[0,0,0]}"#, ""), Triangles(5)),
        // Hostile files.
        (
            "Draco",
            required("KHR_draco_mesh_compression"),
            Refused(&["requires the extension KHR_draco_mesh_compression"]),
        ),
        ("meshopt", required("EXT_meshopt_compression"), Refused(&["EXT_meshopt_compression"])),
        ("glTF 1 as GLB", b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0".into(), Refused(&["glTF 1", "only glTF 2"])),
        (
            "glTF 1 as JSON",
            br#"{"asset":{"version":"1.0"},"meshes":{"a":{}}}"#.into(),
            Refused(&["glTF 1", "only glTF 2 is read"]),
        ),
        ("another version", replaced("2.0", "3.0"), Refused(&["glTF 3.0"])),
        ("no asset", br#"{"meshes":[]}"#.into(), Refused(&["missing field `asset`"])),
        ("no meshes", br#"{"asset":{"version":"2.0"}}"#.into(), Refused(&["no triangles"])),
        ("JSON that is cut short", br#"{"asset":{"version":"2.0""#.into(), Refused(&["line 1, column 25"])),
        (
            "JSON of a million brackets",
            format!(r#"{{"asset":{{"version":"2.0"}},"extras":{}"#, "[".repeat(1 << 20)).into(),
            Refused(&["brackets more than 128 deep"]),
        ),
        (
            "a list of two million entries",
            format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{}{{}}]}}"#, "{},".repeat(2 << 20)).into(),
            Refused(&["more than 1048576 entries"]),
        ),
        (
            "a number in place of a list",
            br#"{"asset":{"version":"2.0"},"nodes":5}"#.into(),
            Refused(&["expected a list"]),
        ),
        ("a GLB header that is cut short", b"glTF\x02\0\0\0".into(), Refused(&["inside its header"])),
        ("a GLB file that is cut short", good[..good.len() - 8].into(), Refused(&["cut short"])),
        (
            "a GLB file without JSON",
            [b"glTF\x02\0\0\0\x14\0\0\0\0\0\0\0BIN\0".as_slice(), &[0; 4]].concat(),
            Refused(&["does not begin with JSON"]),
        ),
        (
            "a part that claims 4 GB",
            {
                let mut file = good.clone();
                file[12..16].fill(0xff);
                file
            },
            Refused(&["claims 4294967295 bytes"]),
        ),
        ("two roots of a node", sample_with(NODE, r#","scenes":[{"nodes":[0,0]}]"#), Refused(&["node 0 stands twice"])),
        (
            "a circle of nodes",
            sample_with(r#"{"mesh":0,"children":[0]}"#, r#","scenes":[{"nodes":[0]}]"#),
            Refused(&["node 0 stands twice"]),
        ),
        (
            "a circle of two nodes",
            sample_with(r#"{"mesh":0,"children":[1]},{"children":[0]}"#, r#","scenes":[{"nodes":[0]}]"#),
            Refused(&["stands twice"]),
        ),
        ("no such node", sample_with(NODE, r#","scenes":[{"nodes":[7]}]"#), Refused(&["no node 7"])),
        ("no such scene", sample_with(NODE, r#","scene":3,"scenes":[{"nodes":[0]}]"#), Refused(&["no scene 3"])),
        ("no such mesh", sample_with(r#"{"mesh":1}"#, ""), Refused(&["node 0", "no mesh 1"])),
        ("no such camera", sample_with(r#"{"mesh":0,"camera":4}"#, ""), Refused(&["no camera 4"])),
        ("no such material", replaced(r#""material":0"#, r#""material":9"#), Refused(&["no material 9"])),
        ("no such accessor", replaced(r#""POSITION":0"#, r#""POSITION":9"#), Refused(&["no accessor 9"])),
        ("no such bufferView", replaced(r#""bufferView":0"#, r#""bufferView":9"#), Refused(&["no bufferView 9"])),
        ("no such buffer", replaced(r#"{"buffer":0"#, r#"{"buffer":9"#), Refused(&["no buffer 9"])),
        ("a negative number", replaced(r#""POSITION":0"#, r#""POSITION":-1"#), Refused(&["-1"])),
        ("no such mode", mode(7), Refused(&["no mode 7"])),
        ("no such componentType", replaced("5126", "5130"), Refused(&["no componentType 5130"])),
        ("positions of the type VEC2", replaced("VEC3", "VEC2"), Refused(&["not of the type VEC3"])),
        ("indices of float", replaced("5125", "5126"), Refused(&["no list of indices"])),
        (
            "an index out of range",
            replaced(r#""count":5"#, r#""count":4"#),
            Refused(&["index 4 is out of range", "4 positions"]),
        ),
        ("14 corners", replaced(r#""count":15"#, r#""count":14"#), Refused(&["14 corners", "multiple of 3"])),
        ("2^64 indices", huge, Refused(&["more than 33554432 triangles or positions"])),
        (
            "indices beyond their bufferView",
            replaced(r#""count":15"#, r#""count":18"#),
            Refused(&["accessor 1: 18 elements reach beyond bufferView 1"]),
        ),
        ("four thousand million positions of zero", zeros, Refused(&["more than 33554432 triangles"])),
        (
            "300000 positions of zero",
            replaced(r#"{"bufferView":0,"componentType":5126,"count":5"#, r#"{"componentType":5126,"count":300000"#),
            Refused(&["accessor 0: without a bufferView it may have up to 262144 elements"]),
        ),
        (
            "instances by an extension",
            sample_with(r#"{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{}}}}"#, ""),
            Noticed(5, &["node 0: EXT_mesh_gpu_instancing is not read; its mesh is drawn once"]),
        ),
        (
            "an offset near 2^64",
            replaced(r#""bufferView":1,"byteOffset":0"#, r#""bufferView":1,"byteOffset":18446744073709551615"#),
            Refused(&["reach beyond bufferView 1"]),
        ),
        (
            "a bufferView near 2^64",
            replaced(r#""byteOffset":60"#, r#""byteOffset":18446744073709551615"#),
            Refused(&["bufferView 1 reaches beyond buffer 0"]),
        ),
        (
            "a stride of 4",
            replaced(r#"{"buffer":0,"#, r#"{"buffer":0,"byteStride":4,"#),
            Refused(&["stride of 4 bytes"]),
        ),
        (
            "a stride near 2^64",
            replaced(r#"{"buffer":0,"#, r#"{"buffer":0,"byteStride":18446744073709551615,"#),
            Refused(&["reach beyond bufferView 0"]),
        ),
        (
            "a buffer longer than its data",
            replaced(r#""buffers":[{"byteLength":120"#, r#""buffers":[{"byteLength":4000"#),
            Refused(&["buffer 0 claims 4000 bytes, and has 120"]),
        ),
        ("a buffer of no data", glb(&written::gltf(&sample(), NODE, "", None).0, &[]), Refused(&["no binary part"])),
        (
            "a sparse accessor",
            replaced(
                r#""count":5,"#,
                r#""count":5,"sparse":{"count":1,"indices":{"bufferView":1,"byteOffset":56,"componentType":5125},"values":{"bufferView":0}},"#,
            ),
            Triangles(5),
        ),
        (
            "a sparse index out of range",
            replaced(
                r#""count":5,"#,
                r#""count":5,"sparse":{"count":1,"indices":{"bufferView":0,"byteOffset":12,"componentType":5125},"values":{"bufferView":0}},"#,
            ),
            Refused(&["sparse part of accessor 0: index 1069547520 is out of range"]),
        ),
        (
            "more sparse elements than elements",
            replaced(
                r#""count":5,"#,
                r#""count":5,"sparse":{"count":6,"indices":{"bufferView":1,"componentType":5125},"values":{"bufferView":0}},"#,
            ),
            Refused(&["sparse part of accessor 0"]),
        ),
        (
            "sparse indices beyond their bufferView",
            replaced(
                r#""count":5,"#,
                r#""count":5,"sparse":{"count":2,"indices":{"bufferView":1,"byteOffset":56,"componentType":5125},"values":{"bufferView":0}},"#,
            ),
            Refused(&["sparse part of accessor 0", "reach beyond"]),
        ),
        (
            "a matrix that is not affine",
            sample_with(r#"{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,1,0,0,0,1]}"#, ""),
            Refused(&["node 0 has a matrix that is not affine"]),
        ),
        (
            "a matrix of 15 numbers",
            sample_with(r#"{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,1,0,0,0]}"#, ""),
            Refused(&["column"]),
        ),
        ("a transform too far away", sample_with(r#"{"mesh":0,"scale":[1e300,1,1]}"#, ""), Refused(&["past 1e15"])),
        (
            "an infinite transform",
            sample_with(r#"{"mesh":0,"scale":[1e999,1,1]}"#, ""),
            Refused(&["number out of range"]),
        ),
        (
            "two of a member",
            sample_with(NODE, &format!(r#","nodes":{}"#, doubled(NODE))),
            Refused(&["duplicate field `nodes`"]),
        ),
        (
            "a file of the web",
            linked("https://example.org/a.bin"),
            Refused(&["\"https://example.org/a.bin\" is not beside the model"]),
        ),
        ("a file above", linked("../../../../../../../../etc/passwd"), Refused(&["is not beside the model"])),
        (
            "a file above, escaped",
            linked("%2e%2e/%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd"),
            Refused(&["is not beside the model"]),
        ),
        ("a file by its whole path", linked("/etc/passwd"), Refused(&["is not beside the model"])),
        ("a device", linked("/dev/zero"), Refused(&["is not beside the model"])),
        ("a folder", linked("."), Refused(&["is not beside the model"])),
        ("a URI with a zero byte", linked("a%00b"), Refused(&["is not beside the model"])),
        ("data that are not base64", linked("data:;base64,@@@@"), Refused(&["not in base64"])),
        ("data in no base64", linked("data:text/plain,abc"), Refused(&["not in base64"])),
        ("data without a comma", linked("data:;base64"), Refused(&["no comma"])),
        ("data that are cut short", linked("data:;base64,AAAA"), Refused(&["claims 120 bytes, and has 3"])),
    ];
    assert!(cases.len() > 60);
    hold_all(&cases);
}

#[test]
fn instances_do_not_multiply_beyond_measure() {
    // 65,536 triangles without a buffer, and 200 nodes that show them.
    let nodes = vec![NODE; 200].join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":196608,"type":"VEC3"}}]}}"#
    );
    hold(
        "thirteen million triangles, and three positions for each",
        json.as_bytes(),
        &Refused(&["node 170: more than 33554432 triangles or positions"]),
    );
}

#[test]
fn primitives_that_show_nothing_do_not_multiply_beyond_measure() {
    let nodes = vec![NODE; 5000].join(",");
    let points = vec![r#"{"attributes":{},"mode":0}"#; 5000].join(",");
    let json = format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{points}]}}]}}"#);
    hold("25 million lists of points", json.as_bytes(), &Refused(&["node 3355: more than 16777216 primitives"]));
}

#[test]
fn cameras_have_names_of_their_own_and_a_mesh_that_an_animation_leaves_is_told() {
    let nodes = r#"{"mesh":0},{"name":"a#2","camera":0},{"name":"a","camera":0},{"name":"a","camera":0}"#;
    let cameras = r#","cameras":[{"perspective":{"yfov":0.5,"znear":0.25}}]"#;
    let scene = open(&sample_with(nodes, cameras), &[]).unwrap();
    let names: Vec<_> = scene.cameras.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["a#2", "a", "a#2#"]);
    // The arm holds the mesh too.
    let scene = open(&animated(r#"{"mesh":0},{"children":[2]"#, r#"{},{"children":[2],"mesh":0"#), &[]).unwrap();
    assert_eq!(scene.motions.len(), 1);
    let said = "node 1: an animation moves it, and only those of cameras are read";
    assert!(scene.notices[0].contains(said), "{:?}", scene.notices);
}

#[test]
fn files_beside_the_model_are_read_also_by_an_escaped_name() {
    for (uri, file) in [("a.bin", "a.bin"), ("b%20c/%C3%A9.bin", "b c/\u{e9}.bin"), ("./x/../a.bin", "a.bin")] {
        let model = linked(uri);
        let scene = open(&model, &[(file, &binary()), ("x/empty", b"")]).unwrap();
        assert_eq!(corners(&scene.mesh), corners(&sample()));
    }
    let short = open(&linked("a.bin"), &[("a.bin", &binary()[..100])]).unwrap_err();
    assert!(short.contains("buffer 0 claims 120 bytes, and has 100"), "{short}");
}

#[test]
fn nodes_are_placed_by_matrices_and_by_their_parts() {
    let turned = format!(r#"[0,{FRAC_1_SQRT_2},0,{FRAC_1_SQRT_2}]"#);
    let nodes = format!(
        r#"{{"children":[1,2],"translation":[1000000.0000001,0,0]}},
        {{"mesh":0,"rotation":{turned},"scale":[2,2,2],"translation":[0,5,0]}},
        {{"mesh":0,"matrix":[0,0,-2,0,0,2,0,0,2,0,0,0,0,5,0,1]}}"#
    );
    let scene = open(&sample_with(&nodes, ""), &[]).unwrap();
    let read = corners(&scene.mesh);
    for (i, triangle) in corners(&sample()).iter().enumerate() {
        for (j, p) in triangle.iter().enumerate() {
            // A quarter turn about y takes z to x.
            let expected = 2.0 * dvec3(p.z, p.y, -p.x) + dvec3(1000000.0000001, 5.0, 0.0);
            assert!(read[i][j].distance(expected) < 1e-9, "{} {expected}", read[i][j]);
            assert!(read[i + 5][j].distance(expected) < 1e-9);
        }
    }
}

#[test]
fn colours_are_those_that_are_shown() {
    let mut mesh = sample();
    let group = |colour, triangles| hbao::scene::Group { colour, triangles };
    mesh = mesh.with_groups(vec![group([1.0, 0.5, 0.0], 0..2), group([0.02, 0.25, 0.75], 2..5)]).unwrap();
    let (json, binary) = written::gltf(&mesh, NODE, "", None);
    let read = open(&glb(&json, &binary), &[]).unwrap().mesh;
    for (got, expected) in read.groups.iter().zip(&mesh.groups) {
        assert_eq!(got.triangles, expected.triangles);
        assert!((0..3).all(|i| (got.colour[i] - expected.colour[i]).abs() < 1e-6), "{got:?} {expected:?}");
    }
}

#[test]
fn quantized_and_sparse_positions_are_read() {
    // Three positions of normalized shorts with a stride of 8, of which a sparse accessor replaces the second.
    let shorts: Vec<u8> = [[0_i16, 0, 0, 7], [1, 1, 1, 7], [0, 32767, -32768, 7]]
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let replacement: Vec<u8> = [16384_i16, 0, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let binary = [shorts, vec![1, 0], replacement].concat();
    let json = r#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":32}],
        "bufferViews":[{"buffer":0,"byteLength":24,"byteStride":8},{"buffer":0,"byteOffset":24,"byteLength":8}],
        "accessors":[{"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3",
        "sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":1,"byteOffset":2}}}]}"#;
    let mesh = open(&glb(json, &binary), &[]).unwrap().mesh;
    assert_eq!(mesh.positions, [DVec3::ZERO, dvec3(16384.0 / 32767.0, 0.0, 0.0), dvec3(0.0, 1.0, -1.0)]);
}

/// A GLB file of the sample and of a camera on an arm, of whose JSON a part is replaced. The arm turns by a quarter
/// about y from second 1 to second 2, and the camera moves from z = 4 to z = 6 at once at second 2.
fn animated(from: &str, to: &str) -> Vec<u8> {
    let more = r#","cameras":[{"perspective":{"yfov":0.5,"znear":0.25}}],"animations":[{"samplers":[
        {"input":2,"output":3},{"input":2,"output":4,"interpolation":"STEP"}],"channels":[
        {"sampler":0,"target":{"node":1,"path":"rotation"}},{"sampler":1,"target":{"node":2,"path":"translation"}}]}]"#;
    let nodes = r#"{"mesh":0},{"children":[2],"translation":[0,7,0]},{"name":"eye","camera":0}"#;
    let (json, mut binary) = written::gltf(&sample(), nodes, more, None);
    let start = binary.len();
    let half = FRAC_1_SQRT_2 as f32;
    for number in [1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half, 0.0, 0.0, 4.0, 0.0, 0.0, 6.0_f32] {
        binary.extend(number.to_le_bytes());
    }
    let (length, all) = (binary.len() - start, binary.len());
    let accessor = |kind: &str, offset: usize| {
        format!(r#",{{"bufferView":2,"byteOffset":{offset},"componentType":5126,"count":2,"type":"{kind}"}}"#)
    };
    let accessors = [accessor("SCALAR", 0), accessor("VEC4", 8), accessor("VEC3", 40)].concat();
    let json = json
        .replacen(r#""SCALAR"}]"#, &format!(r#""SCALAR"}}{accessors}]"#), 1)
        .replacen(
            &format!(r#""byteLength":{}}}],"buffers""#, start - 60),
            &format!(
                r#""byteLength":{}}},{{"buffer":0,"byteOffset":{start},"byteLength":{length}}}],"buffers""#,
                start - 60
            ),
            1,
        )
        .replacen(&format!(r#""buffers":[{{"byteLength":{start}"#), &format!(r#""buffers":[{{"byteLength":{all}"#), 1);
    assert!(json.contains(from), "{from} of {json}");
    glb(&json.replacen(from, to, 1), &binary)
}

#[test]
fn cameras_are_moved_by_the_animations_of_their_nodes() {
    let scene = open(&animated("", ""), &[]).unwrap();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let [(name, motion)] = &scene.motions[..] else { panic!("{:?}", scene.motions) };
    assert_eq!((name.as_str(), motion.frames(10.0)), ("eye", Some(10..=20)));
    let h = FRAC_1_SQRT_2;
    for (time, eye) in [
        (0.0, [0.0, 7.0, 4.0]),
        (1.0, [0.0, 7.0, 4.0]),
        (1.5, [4.0 * h, 7.0, 4.0 * h]),
        (2.0, [6.0, 7.0, 0.0]),
        (9.0, [6.0, 7.0, 0.0]),
    ] {
        let view = motion.view(time).unwrap();
        // The file holds float32.
        assert!(view.eye.unwrap().distance(DVec3::from(eye)) < 1e-6, "{time}: {view:?}");
        let forward = (view.target.unwrap() - view.eye.unwrap()).normalize();
        let expected = -DVec3::new(eye[0], 0.0, eye[2]).normalize();
        assert!(forward.distance(expected) < 1e-6, "{time}: {view:?}");
        assert_eq!((view.lens, view.near), (Some(Lens::FovY(0.5)), Some(0.25)));
    }
    // At rest the camera stands where its nodes are.
    assert_eq!(scene.camera("eye").unwrap().eye, Some(dvec3(0.0, 7.0, 0.0)));
}

#[test]
fn animations_that_are_wrong_leave_their_cameras_where_they_are() {
    let channel = r#"{"sampler":0,"target":{"node":1,"path":"rotation"}}"#;
    for (from, to, said) in [
        (
            r#""input":2"#,
            r#""input":9"#,
            "node 2 'eye': its camera stands still: sampler 0 of animation 0: there is no accessor 9",
        ),
        (r#""input":2"#, r#""input":3"#, "accessor 3 is not of the type SCALAR"),
        (r#""output":3"#, r#""output":4"#, "accessor 4 is not of the type VEC4"),
        (r#""output":4"#, r#""output":3"#, "accessor 3 is not of the type VEC3"),
        (
            r#""interpolation":"STEP""#,
            r#""interpolation":"CUBICSPLINE""#,
            "accessor 4 has 2 elements, and 6 are needed",
        ),
        (r#"{"bufferView":2,"byteOffset":0"#, r#"{"bufferView":2,"byteOffset":12"#, "its times are not"),
        (r#"{"bufferView":2,"byteOffset":0"#, r#"{"bufferView":2,"byteOffset":4"#, "its times are not"),
        (r#""sampler":0"#, r#""sampler":7"#, "sampler 7 of animation 0: it does not exist"),
        (
            r#""translation":[0,7,0]"#,
            r#""matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,7,0,1]"#,
            "node 1 has a matrix, whose parts",
        ),
        (
            r#""componentType":5126,"count":2"#,
            r#""componentType":5126,"count":4000000000"#,
            "more than 1048576 keys in all",
        ),
    ] {
        let scene = open(&animated(from, to), &[]).unwrap_or_else(|e| panic!("{from} {to}: {e}"));
        assert_eq!((scene.motions.len(), scene.cameras.len()), (0, 1), "{to}");
        assert!(scene.notices.len() == 1 && scene.notices[0].contains(said), "{to}: {:?}", scene.notices);
    }
    // What is no motion of a camera is told, or means nothing.
    let mesh = channel.replace(r#""node":1"#, r#""node":0"#);
    let scene = open(&animated(channel, &mesh), &[]).unwrap();
    assert_eq!(scene.motions.len(), 1);
    assert!(scene.notices[0].contains("node 0: an animation moves it, and only those of cameras are read"));
    for other in [channel.replace("rotation", "weights"), channel.replace("\"node\":1,", "")] {
        let scene = open(&animated(channel, &other), &[]).unwrap();
        assert_eq!((scene.motions.len(), scene.notices.len()), (1, 0), "{:?}", scene.notices);
    }
    let pointer = channel.replace("rotation", "pointer").replace("\"node\":1,", "");
    let scene = open(&animated(channel, &pointer), &[]).unwrap();
    assert!(scene.notices[0].contains("animation 0: KHR_animation_pointer is not read"), "{:?}", scene.notices);
}

#[test]
fn animations_of_several_objects_play_together() {
    // The arm and the camera have animations of their own, as some exporters write them.
    let apart = r#"}],"channels":[
        {"sampler":0,"target":{"node":1,"path":"rotation"}}]},{"samplers":[{"input":2,"output":4}],"channels":[
        {"sampler":0,"target":{"node":2,"path":"translation"}}]}]"#;
    let together = r#"},{"input":2,"output":4,"interpolation":"STEP"}],"channels":[
        {"sampler":0,"target":{"node":1,"path":"rotation"}},{"sampler":1,"target":{"node":2,"path":"translation"}}]}]"#;
    let scene = open(&animated(together, apart), &[]).unwrap();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let eye = |time: f64| scene.motions[0].1.view(time).unwrap().eye.unwrap();
    assert!(eye(2.0).distance(dvec3(6.0, 7.0, 0.0)) < 1e-6, "{}", eye(2.0));
    // What two animations move is moved by the first.
    let twice = r#""animations":[{"samplers":[{"input":2,"output":4}],"channels":[
        {"sampler":0,"target":{"node":2,"path":"translation"}}]},{"#;
    let scene = open(&animated(r#""animations":[{"#, twice), &[]).unwrap();
    let said = "node 2 'eye': several animations move the same of its camera, and the first of them is read";
    assert!(scene.notices[0].contains(said), "{:?}", scene.notices);
    let halfway = scene.motions[0].1.view(1.5).unwrap().eye.unwrap();
    assert!((halfway.distance(dvec3(0.0, 7.0, 0.0)) - 5.0).abs() < 1e-6, "{halfway}");
}

#[test]
fn cameras_have_the_place_and_the_lens_of_their_nodes() {
    let nodes = format!(
        r#"{{"mesh":0}},{{"name":"front","camera":0,"translation":[0,1,8]}},
        {{"camera":1,"children":[3],"rotation":[0,{FRAC_1_SQRT_2},0,{FRAC_1_SQRT_2}],"scale":[3,3,3]}},
        {{"camera":1,"translation":[0,0,2]}},{{"camera":2}}"#
    );
    let cameras = r#","cameras":[{"name":"lens","perspective":{"yfov":0.5,"znear":0.25,"zfar":100.5,"aspectRatio":2}},
        {"name":"side","orthographic":{"xmag":4,"ymag":3,"znear":0,"zfar":50}},{"perspective":{"yfov":1,"znear":1}}]"#;
    let scene = open(&sample_with(&nodes, cameras), &[]).unwrap();
    let names: Vec<_> = scene.cameras.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["front", "side", "side#2", "#3"]);
    let front = scene.camera("front").unwrap();
    assert_eq!((front.eye, front.up), (Some(dvec3(0.0, 1.0, 8.0)), Some(DVec3::Y)));
    assert_eq!((front.lens, front.near, front.far), (Some(Lens::FovY(0.5)), Some(0.25), Some(100.5)));
    let (camera, notices) = front.camera(&scene.mesh, 40, 30).unwrap();
    assert_eq!((camera.forward, notices), (DVec3::NEG_Z, vec![]));
    let side = scene.camera("side#2").unwrap();
    assert_eq!((side.lens, side.near, side.far), (Some(Lens::Height(6.0)), None, Some(50.0)));
    assert!(side.eye.unwrap().distance(dvec3(6.0, 0.0, 0.0)) < 1e-12, "{side:?}");
    let (camera, _) = side.camera(&scene.mesh, 40, 30).unwrap();
    assert!(camera.forward.distance(DVec3::NEG_X) < 1e-12, "{camera:?}");
    let unknown = scene.camera("back").unwrap_err();
    assert!(unknown.is_usage());
    assert_eq!(
        unknown.to_string(),
        "--camera 'back' is no camera of the scene: there are 'front', 'side', 'side#2', '#3'"
    );
}
