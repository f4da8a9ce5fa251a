// The surface point P of the pixel that is being shaded, its normal and its jitter.
//
// Compiled in, each if it applies: ORTHOGRAPHIC for an orthographic projection; JITTER_TILE if jitter is on;
// RADIUS_OF_DEPTH if R is in proportion to the depth of P; of normals, NORMALS_RECTANGLE, NORMALS_LAYER or
// NORMALS_MULTISAMPLE, as DEPTH_* in fetch.glsl; NORMALS_VIEWPORT if they are a part of a larger texture;
// NORMALS_REBUILT if the image has a texel for each texel of the target, and not for each pixel; NORMALS_BIASED if
// components are stored as c/2 + 1/2; NORMALS_OCTAHEDRAL if two channels hold them; and NORMALS_MATRIX if they must be
// turned to left-handed eye space.
#if defined(NORMALS_REBUILT)
vec2 normal_place(vec2 p) { return p; }
#elif defined(NORMALS_VIEWPORT)
vec2 normal_place(vec2 p) { return in_viewport(pixel_of(p)); }
#else
vec2 normal_place(vec2 p) { return pixel_of(p); }
#endif

#if defined(NORMALS_RECTANGLE)
uniform sampler2DRect normal_image;
vec3 stored_normal(vec2 p) { return texture(normal_image, normal_place(p)).xyz; }
#elif defined(NORMALS_MULTISAMPLE)
uniform sampler2DMS normal_image;
vec3 stored_normal(vec2 p) { return texelFetch(normal_image, ivec2(normal_place(p)), 0).xyz; }
#else
uniform vec2 normal_texel; // 1 / size of the texture of normals
#ifdef NORMALS_LAYER
uniform sampler2DArray normal_image;
uniform float normal_layer;
vec3 stored_normal(vec2 p)
{
    return textureLod(normal_image, vec3(normal_place(p) * normal_texel, normal_layer), 0.0).xyz;
}
#else
uniform sampler2D normal_image;
vec3 stored_normal(vec2 p) { return textureLod(normal_image, normal_place(p) * normal_texel, 0.0).xyz; }
#endif
#endif
#ifdef NORMALS_MATRIX
uniform mat3 normal_matrix; // to left-handed eye space
#endif

// Returns the normal at a texel of the target in left-handed eye space. It may have any length and face any way.
vec3 normal_at(vec2 p)
{
    vec3 n = stored_normal(p);
#ifdef NORMALS_BIASED
    n = 2.0 * n - 1.0;
#endif
#ifdef NORMALS_OCTAHEDRAL
    // The lower half of the octahedron is folded over the upper one.
    n.z = 1.0 - abs(n.x) - abs(n.y);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    n.xy = n.z < 0.0 ? folded : n.xy;
#endif
#ifdef NORMALS_MATRIX
    n = normal_matrix * n;
#endif
    return n;
}

uniform sampler2DRect tile; // the rotation tile, 4x4 texels of (cos a, sin a, b); for ssao of unit vectors
uniform float radius;       // R in scene units, or at the depth 1
uniform float strength;     // the factor of the occlusion

struct Surface {
    vec2 p;       // window position: a texel's centre
    float z;      // linear depth
    vec2 r;       // x', y' of the ray through p; 0 when orthographic
    vec3 n;       // the normal, of any length, turned towards the eye
    float facing; // -(n.r), at least 0; r is the ray (x', y', 1)
    float R;      // the radius of influence, in scene units
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
    s.n = normal_at(p);
    // The stored normal may have any length. It is scaled so that products of its components neither overflow nor
    // underflow.
    float largest = max(max(abs(s.n.x), abs(s.n.y)), abs(s.n.z));
    s.n /= largest > 0.0 ? largest : 1.0;
    s.facing = -dot(s.n, vec3(s.r, 1.0));
    if (s.facing < 0.0) {
        s.facing = -s.facing;
        s.n = -s.n;
    }
#ifdef RADIUS_OF_DEPTH
    s.R = radius * s.z;
#else
    s.R = radius;
#endif
#ifdef JITTER_TILE
    s.jitter = texture(tile, mod(floor(p), 4.0) + 0.5).xyz;
#else
    s.jitter = vec3(1.0, 0.0, 0.0);
#endif
    return s;
}

// Returns R projected to the image, in texels (Figure 6.2.11).
vec2 radius_in_texels(Surface s)
{
#if defined(ORTHOGRAPHIC) || defined(RADIUS_OF_DEPTH)
    return radius / pixel;
#else
    return radius / (s.z * pixel);
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
