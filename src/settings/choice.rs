//! The settings that take one of a few words, as enums.

/// Declares an enum whose variants have names on the command line and in files.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant),+ }

        impl $name {
            /// Every variant, in the order of [`Self::NAMES`].
            pub const ALL: &'static [$name] = &[$($name::$variant),+];

            /// The variants' names, as flags and files spell them.
            pub const NAMES: &'static [&'static str] = &[$($text),+];

            /// The variant's name, as flags and files spell it.
            pub fn name(self) -> &'static str {
                match self { $($name::$variant => $text),+ }
            }

            /// The variant of this name; or an error that lists the names there are.
            pub(super) fn parse(text: &str) -> Result<$name, String> {
                let found = Self::ALL.iter().find(|variant| variant.name() == text).copied();
                found.ok_or_else(|| {
                    format!("'{}' is none of {}", $crate::Error::shown(text), Self::NAMES.join(", "))
                })
            }
        }
    };
}
pub(super) use choice;

choice! {
    /// W(r), the weight of an occluder at distance r of a radius R.
    Attenuation {
        /// W = 1 - (r/R)^2, the chapter's choice.
        #[default]
        Quadratic = "quadratic",
        /// W = 1 - r/R.
        Linear = "linear",
        /// W = 1.
        None = "none",
    }
}

choice! {
    /// How sample positions are brought to texel centres.
    Snap {
        /// The first offset and the step are rounded once each; samples then walk by whole texels. The chapter's
        /// choice.
        #[default]
        Step = "step",
        /// Each sample's offset is rounded on its own.
        Sample = "sample",
        /// The position is not rounded; the depth comes from the nearest texel.
        None = "none",
    }
}

choice! {
    /// Where a sample beyond the image's border is assumed to lie.
    Clamp {
        /// At the border texel whose depth is read for it.
        #[default]
        Position = "position",
        /// At its own position in x and y, with the border texel's depth.
        Depth = "depth",
    }
}

choice! {
    /// Which tangent a sample's elevation is measured from.
    Grounding {
        /// The tangent in the sample's own direction (Eq. 6.2.9).
        #[default]
        Sample = "sample",
        /// The tangent in the direction that the sample belongs to (Eq. 6.2.8).
        Direction = "direction",
    }
}

choice! {
    /// Where the G-buffer's normals come from.
    Normals {
        /// They are the triangles' own, from screen derivatives of the eye-space position.
        #[default]
        Derivative = "derivative",
        /// They are interpolated from the vertices: the file's normals, or area-weighted ones where it has none.
        Vertex = "vertex",
    }
}

choice! {
    /// Whether directions and steps differ from pixel to pixel, which trades banding for noise.
    Jitter {
        /// A 4x4 tile of random rotations and offsets is repeated over the screen.
        #[default]
        Tile = "tile",
        /// Every pixel has the same directions and steps.
        None = "none",
    }
}

choice! {
    /// The form of the cross-bilateral blur.
    BlurKernel {
        /// One pass in X, then one in Y.
        #[default]
        Separable = "separable",
        /// One pass over the whole square, which is the reference for the separated form.
        Full = "full",
    }
}

choice! {
    /// What the blur does at pixels that hold more than one surface.
    Edges {
        /// The pixel is blurred around each of its depth samples, and the results are averaged.
        #[default]
        Supersample = "supersample",
        /// The pixel is blurred around its resolved depth, as all other pixels are.
        Off = "off",
    }
}

choice! {
    /// How `ssao` turns its offsets from pixel to pixel.
    SsaoRotation {
        /// The rotation that carries the Z axis to the tile's vector is applied.
        #[default]
        Matrix = "matrix",
        /// The offsets are reflected at the plane that has the tile's vector as its normal.
        Mirror = "mirror",
    }
}

choice! {
    /// The depth image that the samples of `ssao` read.
    SsaoDepth {
        /// Depth at the image's own width and height.
        #[default]
        Full = "full",
        /// Depth at half the width and height.
        Half = "half",
    }
}

choice! {
    /// A variation of a method that is on or off.
    Toggle {
        /// Off.
        #[default]
        Off = "off",
        /// On.
        On = "on",
    }
}

choice! {
    /// The texture format of ambient occlusion.
    AoFormat {
        /// 8 bits, the chapter's choice.
        #[default]
        R8 = "r8",
        /// 16-bit float.
        R16f = "r16f",
        /// 32-bit float.
        R32f = "r32f",
    }
}

choice! {
    /// The texture format of the G-buffer's normals.
    NormalFormat {
        /// Signed 8-bit components, the chapter's choice.
        #[default]
        Rgba8Snorm = "rgba8-snorm",
        /// 16-bit float.
        Rgba16f = "rgba16f",
    }
}

choice! {
    /// The texture format of the G-buffer's linear depth.
    DepthFormat {
        /// 32-bit float.
        #[default]
        R32f = "r32f",
        /// 16-bit float, which has 11 significant bits and holds depths from 6.1e-5 to 60000.
        R16f = "r16f",
    }
}
