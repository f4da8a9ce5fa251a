//! The settings whose value is one of a few words, as enums.

/// Declares an enum whose variants are spelled as the given words on the command line and in settings files.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum $name { $($(#[$variant_doc])* $variant),+ }

        impl $name {
            /// Every variant, in the order of [`Self::NAMES`].
            pub const ALL: &'static [$name] = &[$($name::$variant),+];

            /// The names of the variants, as flags and files spell them.
            pub const NAMES: &'static [&'static str] = &[$($text),+];

            /// Returns the name of the variant, as flags and files spell it.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $($name::$variant => $text),+ }
            }

            /// Returns the variant with this name, or an error message that lists all names.
            pub(super) fn parse(text: &str) -> Result<$name, String> {
                let found = Self::ALL.iter().find(|variant| variant.name() == text).copied();
                found.ok_or_else(|| {
                    format!("'{}' is not one of {}", $crate::Error::shown(text), Self::NAMES.join(", "))
                })
            }
        }
    };
}
pub(super) use choice;

choice! {
    /// The attenuation W(r): how much an occluder at the distance r counts, for a radius R.
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
    /// How sample positions are rounded to texel centres.
    Snap {
        /// The first offset and the step are each rounded once, and samples then advance by whole texels. This is the
        /// chapter's choice.
        #[default]
        Step = "step",
        /// The offset of each sample is rounded separately.
        Sample = "sample",
        /// The position is not rounded. The depth is read from the nearest texel.
        None = "none",
    }
}

choice! {
    /// Where a sample beyond the image's border is assumed to lie.
    Clamp {
        /// It lies at the border texel whose depth is read for it.
        #[default]
        Position = "position",
        /// It keeps its own x and y, and takes the depth of the border texel.
        Depth = "depth",
    }
}

choice! {
    /// What a method does where R covers so few texels that N_s steps to R would be shorter than a texel.
    Exit {
        /// It takes no samples: visibility is 1. This is the chapter's early exit (6.2, Variable step size).
        #[default]
        Paper = "paper",
        /// It takes fewer steps, so that each is at least a texel long. Visibility is 1 only if R covers less than 2
        /// texels.
        Shorten = "shorten",
    }
}

choice! {
    /// The tangent from which the elevation of a sample is measured.
    Grounding {
        /// The tangent towards the sample itself (Eq. 6.2.9).
        #[default]
        Sample = "sample",
        /// The tangent in the direction that the sample was taken for (Eq. 6.2.8).
        Direction = "direction",
    }
}

choice! {
    /// The axis from which `hbao-view` measures elevations.
    Zenith {
        /// The view ray through P, about which each direction of the image is one azimuth.
        #[default]
        View = "view",
        /// The Z axis of eye space, as in the chapter.
        Axis = "axis",
    }
}

choice! {
    /// The attenuation of `hbao-view` over a rise of the horizon.
    Quadrature {
        /// W at the sample that the horizon rises to, as in the chapter.
        End = "end",
        /// The mean of W at that sample and of W at the last sample that the horizon rose to, which is 1 at first.
        Mean = "mean",
        /// The mean of W at that sample and of W as far away as the sample before it lies. The more steps there are,
        /// the less it differs from W at the sample.
        Interval = "interval",
        /// The same, times 1 + (1 - q^2) (3/4 - rise)/4, where q is the distance meant for the sample before, divided
        /// by that of the sample. Between two samples the surface is probably higher than a low rise, and an occluder
        /// with a high rise is probably narrow.
        #[default]
        Expected = "expected",
    }
}

choice! {
    /// Where the G-buffer's normals come from.
    Normals {
        /// They are the normals of the triangles, from screen derivatives of the eye-space position.
        #[default]
        Derivative = "derivative",
        /// They are interpolated from the vertices. These have the file's normals, or area-weighted ones if the file
        /// has none.
        Vertex = "vertex",
    }
}

choice! {
    /// Whether directions and steps differ from pixel to pixel, which replaces banding by noise.
    Jitter {
        /// They differ: a 4x4 tile of rotations and offsets is repeated over the screen.
        #[default]
        Tile = "tile",
        /// They are the same for every pixel.
        None = "none",
    }
}

choice! {
    /// Whether the cross-bilateral blur runs in two passes or in one.
    BlurKernel {
        /// One pass in X, then one in Y.
        #[default]
        Separable = "separable",
        /// One pass over the whole square. It is the reference for the separable form.
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
        /// They are rotated by the rotation that carries the z axis to the vector in the tile.
        #[default]
        Matrix = "matrix",
        /// They are reflected in the plane whose normal is the vector in the tile.
        Mirror = "mirror",
    }
}

choice! {
    /// The depth image that the samples of `ssao` read.
    SsaoDepth {
        /// The depth image itself.
        #[default]
        Full = "full",
        /// A copy of it at half the width and height.
        Half = "half",
    }
}

choice! {
    /// Whether a variation of a method is on or off.
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
        /// 8 bits, unsigned and normalised: the chapter's choice.
        #[default]
        R8 = "r8",
        /// 16-bit floating point.
        R16f = "r16f",
        /// 32-bit floating point.
        R32f = "r32f",
    }
}

choice! {
    /// The texture format of the G-buffer's normals.
    NormalFormat {
        /// Signed normalised 8-bit components: the chapter's choice.
        #[default]
        Rgba8Snorm = "rgba8-snorm",
        /// 16-bit floating point.
        Rgba16f = "rgba16f",
    }
}

choice! {
    /// The texture format of the G-buffer's linear depth.
    DepthFormat {
        /// 32-bit floating point.
        #[default]
        R32f = "r32f",
        /// 16-bit floating point. It has 11 significant bits; depths may lie between 6.1e-5, the least with full
        /// precision, and 60000.
        R16f = "r16f",
    }
}
