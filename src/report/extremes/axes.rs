//! The axes of the extremes: what each varies, and what the page says about it.

/// The quantity that one table varies.
pub(super) struct Axis {
    pub(super) name: &'static str,
    /// The table's caption.
    pub(super) title: &'static str,
    /// The note below the table.
    pub(super) note: &'static str,
}

/// The axes, in the order of the tables.
pub(super) const AXES: [Axis; 10] = [
    Axis {
        name: "near-far",
        title: "Near and far planes",
        note: "Nothing depends on the planes but the depth test, whose resolution stands in the next table.",
    },
    Axis {
        name: "distance",
        title: "Distance of the surface from the eye, in R",
        note: "Depth in R32F has steps of 6e-8 of itself. Under perspective they stay below a texel, since R must be several texels or \
         the chapter exits early. An orthographic eye may be anywhere: from 1e4 R on the steps are seen, a stated limit: move \
         the eye towards the scene, which changes nothing else. Normals hold on longer, since positions are taken from the near \
         plane.",
    },
    Axis {
        name: "offset",
        title: "Distance of the scene from the origin",
        note: "Positions are made relative to the camera in float64. What float64 itself cannot tell apart there is lost to \
         the twin too; past 1e15 positions are refused.",
    },
    Axis {
        name: "scale",
        title: "Scale of the scene",
        note: "Everything is relative, and squares fit float32 from 1e-15 to 1e15, past which positions are refused.",
    },
    Axis {
        name: "radius",
        title: "R over the scene's own",
        note: "Below some texels the chapter exits early and A = 1. Far above the scene every sample lies at the border of the picture.",
    },
    Axis {
        name: "fov",
        title: "Vertical field of view, degrees",
        note: "Near 180 degrees a plane of the picture's border is met far away, by rays almost along it: depth is extrapolated.",
    },
    Axis {
        name: "grazing",
        title: "A floor with a wall on it, by the angle at which it is seen, degrees",
        note: "z = (n.Q)/(n.r) divides by the sine of this angle, and what moves z onto the ray is no longer than a pixel. From some angle \
         on a pixel's neighbours on the floor lie farther away than R.",
    },
    Axis {
        name: "extent",
        title: "Half the side of a floor of two triangles, in heights of the eye",
        note: "A corner at a distance L is placed to 6e-8 L, wherever in the triangle one looks. A triangle of 1e4 times what is looked \
         at is seen at a depth that is off by as much, of 1e7 times in part or not at all: a stated limit; cut it into smaller \
         ones. It stays a plane, so that it does not occlude itself.",
    },
    Axis {
        name: "samples",
        title: "Directions x steps",
        note: "Rounding adds up like the root of the samples, far below a step of 8 bits.",
    },
    Axis {
        name: "formats",
        title: "Formats",
        note: "Half floats have 11 bits: neighbours on a tilted plane rise and fall by a step of depth that is a share of R, so that planes \
         occlude themselves, which on an open floor an angle bias hides; the smaller R, the more. Eight bits of a normal are up to 0.3 degrees. \
         Below a near plane of 6.1e-5 half floats lose their bits, and past 60000 their range: both are refused.",
    },
];
