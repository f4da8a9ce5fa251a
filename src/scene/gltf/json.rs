//! The parts of a glTF file's JSON that are read. All others are skipped, and need no memory.

use serde::Deserialize;
use serde::de::{Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

/// The most entries of a list, so that a list of `{},{},{}` does not fill the memory.
const MOST_ENTRIES: usize = 1 << 20;

/// A list of limited length.
pub(super) struct List<T>(Vec<T>);

impl<T> Default for List<T> {
    fn default() -> List<T> {
        List(Vec::new())
    }
}

impl<T> Deref for List<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<List<T>, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = List<T>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<List<T>, A::Error> {
                let mut list = Vec::new();
                while let Some(entry) = entries.next_element()? {
                    if list.len() == MOST_ENTRIES {
                        return Err(A::Error::custom(format!("a list of more than {MOST_ENTRIES} entries")));
                    }
                    list.push(entry);
                }
                Ok(List(list))
            }

            fn visit_map<A: MapAccess<'de>>(self, _: A) -> Result<List<T>, A::Error> {
                Err(A::Error::custom("an object in place of a list, as in glTF 1; only glTF 2 is read"))
            }
        }
        deserializer.deserialize_any(Entries(PhantomData))
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root {
    pub(super) asset: Asset,
    pub(super) scene: Option<u32>,
    #[serde(default)]
    pub(super) scenes: List<Roots>,
    #[serde(default)]
    pub(super) nodes: List<Node>,
    #[serde(default)]
    pub(super) meshes: List<Shape>,
    #[serde(default)]
    pub(super) materials: List<Material>,
    #[serde(default)]
    pub(super) cameras: List<Camera>,
    #[serde(default)]
    pub(super) animations: List<Animation>,
    #[serde(default)]
    pub(super) textures: List<Texture>,
    #[serde(default)]
    pub(super) images: List<Image>,
    #[serde(default)]
    pub(super) samplers: List<Sampler>,
    #[serde(default)]
    pub(super) accessors: List<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: List<BufferView>,
    #[serde(default)]
    pub(super) buffers: List<Buffer>,
    #[serde(default)]
    pub(super) extensions_required: List<String>,
}

#[derive(Deserialize)]
pub(super) struct Asset {
    pub(super) version: String,
}

/// A scene.
#[derive(Deserialize)]
pub(super) struct Roots {
    #[serde(default)]
    pub(super) nodes: List<u32>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) name: Option<Box<str>>,
    #[serde(default)]
    pub(super) children: List<u32>,
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
    pub(super) mesh: Option<u32>,
    pub(super) camera: Option<u32>,
    pub(super) skin: Option<IgnoredAny>,
    #[serde(default)]
    pub(super) extensions: NodeExtensions,
}

#[derive(Default, Deserialize)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<IgnoredAny>,
}

/// A mesh.
#[derive(Deserialize)]
pub(super) struct Shape {
    pub(super) primitives: List<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    pub(super) indices: Option<u32>,
    pub(super) material: Option<u32>,
    #[serde(default = "triangles")]
    pub(super) mode: u32,
    pub(super) targets: Option<IgnoredAny>,
}

fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<u32>,
    #[serde(rename = "NORMAL")]
    pub(super) normal: Option<u32>,
    #[serde(rename = "COLOR_0")]
    pub(super) colour: Option<u32>,
    #[serde(rename = "TEXCOORD_0")]
    texcoord_0: Option<u32>,
    #[serde(rename = "TEXCOORD_1")]
    texcoord_1: Option<u32>,
    #[serde(rename = "TEXCOORD_2")]
    texcoord_2: Option<u32>,
    #[serde(rename = "TEXCOORD_3")]
    texcoord_3: Option<u32>,
}

impl Attributes {
    /// Returns the accessor of a set of texture coordinates. Of more than four sets only the first four are read.
    pub(super) fn coordinates(&self, set: u32) -> Option<u32> {
        let sets = [self.texcoord_0, self.texcoord_1, self.texcoord_2, self.texcoord_3];
        sets.get(set as usize).copied().flatten()
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Material {
    #[serde(default)]
    pub(super) pbr_metallic_roughness: Surface,
    pub(super) name: Option<Box<str>>,
    #[serde(default)]
    pub(super) extensions: MaterialExtensions,
    #[serde(default)]
    pub(super) alpha_mode: AlphaMode,
    pub(super) alpha_cutoff: Option<f64>,
}

#[derive(Default, Deserialize)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub(super) specular_glossiness: Option<Box<SpecularGlossiness>>,
}

/// The surface that takes the place of `pbrMetallicRoughness` in files of an older way of exporting.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    pub(super) diffuse_factor: Option<Box<[f64; 4]>>,
    pub(super) diffuse_texture: Option<TextureInfo>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq, Eq)]
pub(super) enum AlphaMode {
    #[default]
    #[serde(rename = "OPAQUE")]
    Opaque,
    #[serde(rename = "MASK")]
    Mask,
    #[serde(rename = "BLEND")]
    Blend,
    #[serde(other)]
    Other,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Surface {
    pub(super) base_color_factor: Option<Box<[f64; 4]>>,
    pub(super) base_color_texture: Option<TextureInfo>,
}

/// Which texture is laid on a surface, and how.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub(super) index: u32,
    #[serde(default)]
    pub(super) tex_coord: u32,
    #[serde(default)]
    pub(super) extensions: TextureExtensions,
}

#[derive(Default, Deserialize)]
pub(super) struct TextureExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(super) transform: Option<Box<TextureTransform>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureTransform {
    #[serde(default)]
    pub(super) offset: [f64; 2],
    #[serde(default)]
    pub(super) rotation: f64,
    #[serde(default = "ones")]
    pub(super) scale: [f64; 2],
    pub(super) tex_coord: Option<u32>,
}

fn ones() -> [f64; 2] {
    [1.0; 2]
}

#[derive(Deserialize)]
pub(super) struct Texture {
    pub(super) sampler: Option<u32>,
    /// Missing if an extension has another image, in a format that is not read.
    pub(super) source: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image {
    pub(super) uri: Option<Box<str>>,
    pub(super) buffer_view: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Sampler {
    pub(super) wrap_s: Option<u32>,
    pub(super) wrap_t: Option<u32>,
}

#[derive(Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    pub(super) channels: List<Channel>,
    #[serde(default)]
    pub(super) samplers: List<AnimationSampler>,
}

/// What a sampler of an animation moves.
#[derive(Deserialize)]
pub(super) struct Channel {
    pub(super) sampler: u32,
    pub(super) target: AnimationTarget,
}

#[derive(Deserialize)]
pub(super) struct AnimationTarget {
    pub(super) node: Option<u32>,
    pub(super) path: AnimationPath,
}

#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub(super) enum AnimationPath {
    Translation,
    Rotation,
    Scale,
    /// Of `KHR_animation_pointer`.
    Pointer,
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
pub(super) struct AnimationSampler {
    pub(super) input: u32,
    pub(super) output: u32,
    #[serde(default)]
    pub(super) interpolation: Spline,
}

#[derive(Clone, Copy, Default, Deserialize)]
pub(super) enum Spline {
    #[default]
    #[serde(rename = "LINEAR")]
    Linear,
    #[serde(rename = "STEP")]
    Step,
    #[serde(rename = "CUBICSPLINE")]
    Cubic,
}

#[derive(Deserialize)]
pub(super) struct Camera {
    pub(super) name: Option<Box<str>>,
    pub(super) perspective: Option<Perspective>,
    pub(super) orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
pub(super) struct Perspective {
    pub(super) yfov: f64,
    pub(super) znear: f64,
    pub(super) zfar: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub(super) ymag: f64,
    pub(super) znear: f64,
    pub(super) zfar: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<u32>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: Components,
    pub(super) sparse: Option<Box<Sparse>>,
}

#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
pub(super) enum Components {
    #[serde(rename = "SCALAR")]
    Scalar,
    #[serde(rename = "VEC2")]
    Vec2,
    #[serde(rename = "VEC3")]
    Vec3,
    #[serde(rename = "VEC4")]
    Vec4,
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: u32,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: u32,
    #[serde(default)]
    pub(super) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: u32,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) byte_length: u64,
    pub(super) uri: Option<Box<str>>,
}
