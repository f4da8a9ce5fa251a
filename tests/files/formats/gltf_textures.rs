//! The textures of glTF files, and where alpha cuts surfaces away: what is read, each kind of file with its verdict.

use super::{Noticed, Refused, Triangles, base64, hold, open};
use crate::written::glb;
use hbao::scene::Scene;
use std::f64::consts::FRAC_PI_2;
use std::fs;
use tempfile::TempDir;

/// A picture of 4x2 texels with four values of alpha.
fn picture() -> image::RgbaImage {
    let alpha = |x: u32, y: u32| [0, 100, 200, 255][((x + y) % 4) as usize];
    image::RgbaImage::from_fn(4, 2, |x, y| image::Rgba([50 * x as u8, 200 * y as u8, 99, alpha(x, y)]))
}

fn encoded(format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::DynamicImage::from(picture());
    if format == image::ImageFormat::Png { picture } else { picture.to_rgb8().into() }
        .write_to(&mut bytes, format)
        .unwrap();
    bytes.into_inner()
}

/// The parts of a glTF file of one square in two triangles, which may be replaced.
struct Square<'a> {
    material: &'a str,
    info: &'a str,
    textures: &'a str,
    images: &'a str,
    samplers: &'a str,
    attributes: &'a str,
    picture: Vec<u8>,
}

impl Default for Square<'_> {
    fn default() -> Self {
        Square {
            material: "",
            info: "",
            textures: r#"{"source":0,"sampler":0}"#,
            images: r#"{"bufferView":1,"mimeType":"image/png"}"#,
            samplers: "{}",
            attributes: r#","TEXCOORD_0":1"#,
            picture: encoded(image::ImageFormat::Png),
        }
    }
}

/// The texture coordinates of the square, with v down.
const COORDINATES: [[f32; 2]; 4] = [[-0.25, 1.5], [2.25, 1.5], [2.25, -0.5], [-0.25, -0.5]];

impl Square<'_> {
    fn glb(&self) -> Vec<u8> {
        let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut binary: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        binary.extend(COORDINATES.iter().flatten().flat_map(|x| x.to_le_bytes()));
        binary.extend([0, 1, 2, 0, 2, 3, 0, 0]);
        let start = binary.len();
        binary.extend(&self.picture);
        let Square { material, info, textures, images, samplers, attributes, picture } = self;
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"buffers":[{{"byteLength":{}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{attributes}}},"indices":2,"material":0}}]}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0{info}}}}}{material}}}],
            "textures":[{textures}],"images":[{images}],"samplers":[{samplers}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
            {{"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC2"}},
            {{"bufferView":0,"byteOffset":80,"componentType":5121,"count":6,"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":88}},{{"buffer":0,"byteOffset":{start},"byteLength":{}}}]}}"#,
            binary.len(),
            picture.len(),
        );
        glb(&json, &binary)
    }
}

/// Returns the hash of the same square as an OBJ file, with v up, these statements in its material, and texture
/// coordinates that `placed` makes of those of the GLB file.
fn obj(material: &str, placed: fn([f64; 2]) -> [f64; 2]) -> String {
    let folder = TempDir::new().unwrap();
    let colours = picture();
    let save = |name: &str, is_cut: fn(u8) -> bool| {
        let texel = |x, y| image::Luma([if is_cut(colours[(x, y)].0[3]) { 0 } else { 255 }]);
        image::GrayImage::from_fn(4, 2, texel).save(folder.path().join(name)).unwrap();
    };
    save("half.png", |alpha| alpha < 128);
    save("third.png", |alpha| alpha < 90);
    fs::write(folder.path().join("p.jpg"), encoded(image::ImageFormat::Jpeg)).unwrap();
    image::DynamicImage::from(picture()).to_rgb8().save(folder.path().join("opaque.png")).unwrap();
    fs::write(folder.path().join("m.mtl"), format!("newmtl a\n{material}\n")).unwrap();
    let mut text = "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n".to_string();
    for at in COORDINATES {
        let [u, v] = placed(at.map(f64::from));
        text += &format!("vt {u} {v}\n");
    }
    text += "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    fs::write(folder.path().join("m.obj"), text).unwrap();
    let scene = Scene::open(folder.path().join("m.obj")).unwrap();
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    scene.mesh.sha256()
}

const MASK: &str = r#","alphaMode":"MASK""#;
const THIRD: &str = r#","alphaMode":"MASK","alphaCutoff":0.35"#;

#[test]
fn textures_are_those_of_obj_with_v_turned_over() {
    let square = Square::default;
    let up: fn([f64; 2]) -> [f64; 2] = |[u, v]| [u, 1.0 - v];
    let data = format!(r#"{{"uri":"data:image/png;base64,{}"}}"#, base64(&encoded(image::ImageFormat::Png)));
    let moved = r#","extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"scale":[2,4]}}"#;
    let turned = r#","texCoord":3,"extensions":{"KHR_texture_transform":
        {"offset":[0,1],"rotation":1.5707963267948966,"texCoord":0}}"#;
    let cases = [
        ("alpha without a mode", square(), obj("map_Kd opaque.png", up)),
        ("a mask", Square { material: MASK, ..square() }, obj("map_Kd opaque.png\nmap_d half.png", up)),
        (
            "blending",
            Square { material: r#","alphaMode":"BLEND""#, ..square() },
            obj("map_Kd opaque.png\nmap_d half.png", up),
        ),
        ("a cutoff", Square { material: THIRD, ..square() }, obj("map_Kd opaque.png\nmap_d third.png", up)),
        (
            "a JPEG picture",
            Square { material: MASK, picture: encoded(image::ImageFormat::Jpeg), ..square() },
            obj("map_Kd p.jpg", up),
        ),
        ("a data: URI", Square { images: &data, ..square() }, obj("map_Kd opaque.png", up)),
        (
            "the border goes on",
            Square { samplers: r#"{"wrapS":33071,"wrapT":33071}"#, material: MASK, ..square() },
            obj("map_Kd -clamp on opaque.png\nmap_d -clamp on half.png", up),
        ),
        (
            "a transform",
            Square { info: moved, ..square() },
            obj("map_Kd opaque.png", |[u, v]| [2.0 * u + 0.5, 1.0 - (4.0 * v + 0.25)]),
        ),
        (
            // As in the extension's own example, (0, 0) is laid on the lower left corner of the picture, which is (0,
            // 1), and (1, 0) above it, on (0, 0).
            "a quarter turn",
            Square { info: turned, ..square() },
            obj("map_Kd opaque.png", |[u, v]| {
                let (sine, cosine) = (libm::sin(FRAC_PI_2), libm::cos(FRAC_PI_2));
                [cosine * u + sine * v, 1.0 - (cosine * v - sine * u + 1.0)]
            }),
        ),
    ];
    let read = |name: &str, square: &Square| {
        let scene = open(&square.glb(), &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
        let blends = scene.notices.iter().all(|notice| notice.contains("material 0: its alphaMode is BLEND"));
        assert!(scene.notices.len() == usize::from(name == "blending") && blends, "{name}: {:?}", scene.notices);
        scene.mesh.sha256()
    };
    for (name, square, expected) in cases {
        assert_eq!(read(name, &square), expected, "{name}");
        let mirrored = Square { samplers: r#"{"wrapS":33648}"#, ..square };
        assert_ne!(read(name, &mirrored), expected, "{name}, mirrored");
    }
    // Files are found as those of OBJ are.
    let png = encoded(image::ImageFormat::Png);
    for uri in ["a%20picture.png", "./a%20picture.png", "/home/somebody/A%20Picture.PNG", "C:\\\\x\\\\a%20picture.png"]
    {
        let images = format!(r#"{{"uri":"{uri}"}}"#);
        let linked = Square { images: &images, ..square() };
        let scene = open(&linked.glb(), &[("a picture.png", &png)]).unwrap();
        assert_eq!(scene.mesh.sha256(), obj("map_Kd opaque.png", up), "{uri}: {:?}", scene.notices);
    }
    let broken = Square { images: r#"{"uri":"a.png"}"#, ..square() };
    let scene = open(&broken.glb(), &[("a.png", &png[..40])]).unwrap();
    assert!(scene.notices[0].contains("image 0: \"a.png\" cannot be read"), "{:?}", scene.notices);
    // An older way of exporting.
    let old = r#","name":"wall","extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseTexture":{"index":0}}}"#;
    assert_eq!(read("specular", &Square { material: old, ..square() }), obj("map_Kd opaque.png", up));
}

#[test]
fn every_kind_of_texture_has_its_verdict() {
    let square = Square::default;
    let image = |images| Square { images, ..square() }.glb();
    let png = encoded(image::ImageFormat::Png);
    let cut_short = png[..png.len() / 2].to_vec();
    let tinted = |alpha: &str, mode: &str| {
        let material = format!(r#"{mode},"pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,{alpha}]}}"#);
        let json = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"buffers":[{"byteLength":36}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0},{"attributes":{"POSITION":0}}]}],
            "materials":[{MATERIAL}],"bufferViews":[{"buffer":0,"byteLength":36}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]}"#;
        glb(&json.replace("MATERIAL", material.trim_start_matches(',')), &[0; 36])
    };
    let cases = [
        ("no coordinates", Square { attributes: "", ..square() }.glb(), {
            Noticed(
                2,
                &["node 0: a primitive lacks TEXCOORD_0, and its material has a texture; no texture is laid on it"],
            )
        }),
        ("another set", Square { info: r#","texCoord":1"#, ..square() }.glb(), Noticed(2, &["lacks TEXCOORD_1"])),
        ("a fifth set", Square { info: r#","texCoord":4"#, ..square() }.glb(), Noticed(2, &["lacks TEXCOORD_4"])),
        (
            "coordinates of the type VEC3",
            Square { attributes: r#","TEXCOORD_0":0"#, ..square() }.glb(),
            Refused(&["accessor 0 is not of the type VEC2"]),
        ),
        (
            "a transform to no place",
            Square { info: r#","extensions":{"KHR_texture_transform":{"scale":[1e9,1]}}"#, ..square() }.glb(),
            Noticed(2, &["texture coordinates past 1e6 in magnitude, or not finite"]),
        ),
        ("no such sampler", Square { textures: r#"{"source":0,"sampler":9}"#, ..square() }.glb(), Triangles(2)),
        ("a sampler of no kind", Square { samplers: r#"{"wrapS":1}"#, ..square() }.glb(), Triangles(2)),
        (
            "no such image",
            Square { textures: r#"{"source":7}"#, ..square() }.glb(),
            Noticed(2, &["material 0: there is no image 7"]),
        ),
        (
            "an image of an extension",
            Square { textures: r#"{"extensions":{"KHR_texture_basisu":{"source":0}}}"#, ..square() }.glb(),
            Noticed(2, &["material 0: texture 0 has no PNG or JPEG picture; export the textures as PNG; its material"]),
        ),
        (
            "an image of an extension, with another for those that do not know it",
            Square { textures: r#"{"source":0,"extensions":{"EXT_texture_webp":{"source":9}}}"#, ..square() }.glb(),
            Triangles(2),
        ),
        (
            "an image without a place",
            image("{}"),
            Noticed(2, &["material 0: image 0: it has neither a uri nor a bufferView"]),
        ),
        ("no such bufferView", image(r#"{"bufferView":9}"#), Noticed(2, &["there is no bufferView 9"])),
        (
            "a file that is missing",
            image(r#"{"uri":"a.png"}"#),
            Noticed(2, &["material 0: image 0: \"a.png\" is not beside the model; its material"]),
        ),
        ("a file above", image(r#"{"uri":"../../etc/passwd"}"#), Noticed(2, &["is not beside the model"])),
        (
            "a file of the web",
            image(r#"{"uri":"https://example.org/a.png"}"#),
            Noticed(2, &["is not beside the model"]),
        ),
        ("data that are not base64", image(r#"{"uri":"data:image/png;base64,@"}"#), Noticed(2, &["not in base64"])),
        (
            "data that are no picture",
            image(r#"{"bufferView":0}"#),
            Noticed(2, &["is no PNG, JPEG, TGA or BMP picture"]),
        ),
        (
            "a picture cut short",
            Square { picture: cut_short, ..square() }.glb(),
            Noticed(2, &["material 0: image 0 cannot be read"]),
        ),
        ("alpha that does not matter", tinted("0", ""), Triangles(2)),
        ("alpha at the cutoff", tinted("0.5", MASK), Triangles(2)),
        (
            "alpha below the cutoff",
            tinted("0.4", MASK),
            Noticed(1, &["material 0: alpha 0.4 is below 0.5; its triangles are"]),
        ),
        ("alpha above a lower cutoff", tinted("0.4", THIRD), Triangles(2)),
        ("a mode that is not known", tinted("0.4", r#","alphaMode":"GLASS""#), Triangles(2)),
    ];
    for (name, file, verdict) in &cases {
        hold(name, file, verdict);
    }
}

#[test]
fn alpha_of_vertices_is_told_where_it_would_cut() {
    let dim = r#","alphaMode":"MASK","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.6]}"#;
    for (alpha, mode, told) in [("0.4", MASK, true), ("0.4", "", false), ("0.6", MASK, false), ("0.7", dim, true)] {
        let alpha: f32 = alpha.parse().unwrap();
        let mut binary = vec![0; 36];
        binary.extend([1.0, 1.0, 1.0, alpha].repeat(3).iter().flat_map(|x: &f32| x.to_le_bytes()));
        let json = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"buffers":[{"byteLength":84}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1},"material":0}]}],
            "materials":[{"name":"a" MODE}],"bufferViews":[{"buffer":0,"byteLength":84}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
            {"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC4"}]}"#;
        let notices = open(&glb(&json.replace("MODE", mode), &binary), &[]).unwrap().notices;
        let expected = "node 0: the alpha of vertices is not read, and it is below the cutoff of their material";
        assert_eq!(notices.iter().any(|notice| notice.contains(expected)), told, "{alpha} {mode}: {notices:?}");
    }
}
