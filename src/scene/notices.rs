//! Collects what a model's files hold that is left out: material files, colours and normals that cannot be read. No
//! model is refused because of them, and each kind is told in one line.

use std::collections::BTreeMap;

/// A kind of thing that is left out. The kinds are told in this order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A face of fewer than three corners.
    Face,
    /// A triangle of an STL file without an area.
    Facet,
    /// Points, lines or other parts of a glTF file that are no triangles.
    Primitive,
    /// The end of an STL file that is missing.
    End,
    /// The colours of an STL file.
    Tints,
    /// The texture of a PLY file.
    PlyTexture,
    /// The texture of a glTF file.
    Picture,
    /// A material of a glTF file that is blended with what lies behind it.
    Blend,
    /// Alpha of a glTF file's vertices.
    VertexAlpha,
    /// Instances of a glTF file that an extension describes.
    Instances,
    /// A skin or morph targets.
    Pose,
    /// The motion of a camera.
    Motion,
    /// A camera that cannot be used.
    Camera,
    /// A `vn` statement that gives no direction.
    Normal,
    /// A corner whose index of a normal is wrong.
    NormalIndex,
    /// A material file that cannot be read.
    Library,
    /// A material file after the most that are read.
    Excess,
    /// A `Kd` statement that gives no colour.
    Colour,
    /// A `Kd` statement with a number above 1.
    Bright,
    /// A texture that cannot be read, or a wrong `map_Kd` statement.
    Texture,
    /// A texture that cannot be read, or a wrong `map_d` statement.
    Cut,
    /// A `d` statement that gives no number.
    Dissolve,
    /// A material with `d` below 1/2.
    Invisible,
    /// A statement about a material's texture that is not read.
    Ignored,
    /// A `vt` statement that gives no point of a texture.
    Coordinate,
    /// A corner whose index of a texture coordinate is wrong.
    CoordinateIndex,
    /// A triangle of an OBJ file, or a primitive of a glTF file, without texture coordinates whose material has a
    /// texture.
    Bare,
    /// A material that a `usemtl` statement names and no material file defines.
    Material,
}

impl Kind {
    /// Returns the plural that counts things of this kind, and what is done about them.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Kind::Normal => ("normals", "the triangles give the normal there"),
            Kind::NormalIndex => ("corners", "the triangles give the normal there"),
            Kind::Library => ("material files", "its materials are white"),
            Kind::Excess => ("material files", "its materials are white"),
            Kind::Colour => ("colours", "its material is white"),
            Kind::Bright => ("colours", "it is taken as 1; write colours from 0 to 1"),
            Kind::Texture => ("textures", "its material has the colour of Kd"),
            Kind::Cut => ("textures", "nothing is cut out of its material"),
            Kind::Dissolve => ("materials", "its material is opaque"),
            Kind::Invisible => ("materials", "its triangles are left out"),
            Kind::Ignored => ("statements", "materials have map_Kd, map_d, Kd and d alone"),
            Kind::Coordinate => ("texture coordinates", "no texture is laid on its faces"),
            Kind::CoordinateIndex => ("corners", "no texture is laid on its face"),
            Kind::Bare => ("surfaces", "no texture is laid on it, and nothing is cut out of it"),
            Kind::Facet => ("triangles", "it is left out"),
            Kind::Primitive => ("primitives", "it is left out"),
            Kind::End => ("ends", "it may have been cut short"),
            Kind::Tints => ("colours", "the surface is white"),
            Kind::PlyTexture => ("textures", "the surface has the colours of its vertices, or is white"),
            Kind::Picture => ("textures", "its material has the colour of baseColorFactor"),
            Kind::Blend => ("materials", "it is opaque from alpha 1/2 on, and cut away below"),
            Kind::VertexAlpha => ("primitives", "it is taken as 1"),
            Kind::Instances => ("nodes", "its mesh is drawn once"),
            Kind::Pose => ("parts", "it is drawn in its rest pose"),
            Kind::Motion => ("cameras", "give --path or --turntable to move it otherwise"),
            Kind::Camera => ("cameras", "it is left out"),
            Kind::Face => ("faces", "it is left out"),
            Kind::Material => ("materials", "its triangles are white"),
        }
    }
}

/// The first thing of each kind, in words that begin with its file and line, and how many there are.
#[derive(Default)]
pub(super) struct Notices(BTreeMap<Kind, (String, u64)>);

impl Notices {
    /// Counts one thing. `first` describes it, and is called only if it is the first of its kind.
    pub(super) fn add(&mut self, kind: Kind, first: impl FnOnce() -> String) {
        self.0.entry(kind).or_insert_with(|| (first(), 0)).1 += 1;
    }

    /// Adds the notices of `other`, which are of other kinds.
    pub(super) fn extend(&mut self, other: Notices) {
        self.0.extend(other.0);
    }

    /// Returns true if there is a notice of this kind.
    pub(super) fn has(&self, kind: Kind) -> bool {
        self.0.contains_key(&kind)
    }

    /// Returns one line for each kind.
    pub(super) fn lines(self) -> Vec<String> {
        let line = |(kind, (first, count)): (Kind, (String, u64))| {
            let (such, then) = kind.words();
            let of = if count > 1 { format!(" (the first of {count} such {such})") } else { String::new() };
            format!("{first}{of}; {then}")
        };
        self.0.into_iter().map(line).collect()
    }
}
