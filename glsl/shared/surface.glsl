// The surface point P of the pixel that is being shaded, its normal and its jitter.
//
// Compiled in, each if it applies: ORTHOGRAPHIC for an orthographic projection; NORMALS_RECTANGLE if normals are in a
// rectangle texture; NORMALS_BIASED if they are stored as n/2 + 1/2; JITTER_TILE if jitter is on.
#ifdef NORMALS_RECTANGLE
uniform sampler2DRect normal_image;
vec3 stored_normal(vec2 p) { return texture(normal_image, pixel_of(p)).xyz; }
#else
uniform sampler2D normal_image;
vec3 stored_normal(vec2 p) { return textureLod(normal_image, pixel_of(p) * texel, 0.0).xyz; }
#endif

uniform sampler2DRect tile; // the rotation tile, 4x4 texels of (cos a, sin a, b); for ssao of unit vectors
uniform float radius;       // R, in scene units
uniform float strength;     // the factor of the occlusion

struct Surface {
    vec2 p;       // window position: a texel's centre
    float z;      // linear depth
    vec2 r;       // x', y' of the ray through p; 0 when orthographic
    vec3 n;       // the normal, of any length, turned towards the eye
    float facing; // -(n.r), at least 0; r is the ray (x', y', 1)
    vec3 jitter;  // the tile's texel for this pixel
};

Surface surface_at(vec2 p)
{
    Surface s;
    s.p = p;
    s.z = depth_at(p);
#ifdef ORTHOGRAPHIC
    s.r = vec2(0.0);
#else
    s.r = slope(p);
#endif
    s.n = stored_normal(p);
#ifdef NORMALS_BIASED
    s.n = 2.0 * s.n - 1.0;
#endif
    // The stored normal may have any length. It is scaled so that products of its components neither overflow nor
    // underflow.
    float largest = max(max(abs(s.n.x), abs(s.n.y)), abs(s.n.z));
    s.n /= largest > 0.0 ? largest : 1.0;
    s.facing = -dot(s.n, vec3(s.r, 1.0));
    if (s.facing < 0.0) {
        s.facing = -s.facing;
        s.n = -s.n;
    }
#ifdef JITTER_TILE
    s.jitter = texture(tile, mod(floor(p), 4.0) + 0.5).xyz;
#else
    s.jitter = vec3(1.0, 0.0, 0.0);
#endif
    return s;
}

// Returns R projected to the image at the depth z, in texels (Figure 6.2.11).
vec2 radius_in_texels(float z)
{
#ifdef ORTHOGRAPHIC
    return radius / pixel;
#else
    return radius / (z * pixel);
#endif
}

// Returns a unit vector in the image, turned by the tile's angle a.
vec2 turned(vec2 unit, vec3 jitter)
{
    return vec2(unit.x * jitter.x - unit.y * jitter.y, unit.y * jitter.x + unit.x * jitter.y);
}

// Returns D = S - P for the point S that has the depth z and lies `at` texels from P in the image. In perspective D.xy
// = S.z (r + at pixel) - P.z r. The form below is equal, and does not subtract two large positions.
vec3 from_surface(Surface s, vec2 at, float z)
{
    float dz = z - s.z;
#ifdef ORTHOGRAPHIC
    return vec3(at * pixel, dz);
#else
    return vec3(dz * s.r + z * (at * pixel), dz);
#endif
}
