// The G-buffer: linear depth, normal and colour of the surface, evaluated on the ray through the pixel's centre.
// The float64 twin is src/reference/gbuffer.rs, which finds the same surface by ray casting.
//
// Compiled in: ORTHOGRAPHIC for an orthographic projection; NORMALS_BIASED if normals are stored as n/2 + 1/2; COLOUR
// if an image needs the colour; with it, TEXTURED if materials have textures, and VERTEX_COLOURS if vertices
// have colours; CUT if textures cut surfaces away; and either NORMALS_DERIVATIVE (the triangle's normal) or
// NORMALS_VERTEX (the interpolated vertex normal).
in vec3 position; // in eye space, relative to the near plane: (x, y, z - near); if orthographic, to the near plane's middle
#ifdef NORMALS_VERTEX
in vec3 smooth_normal;
#endif
#if defined(TEXTURED) || defined(CUT)
in vec2 coordinates; // of textures
#endif
#ifdef VERTEX_COLOURS
in vec3 tint; // the colour of the vertices
#endif

uniform vec2 near_far; // the depths of the near and the far plane

out float out_0; // linear depth
out vec4 out_1; // normal
#ifdef COLOUR
uniform vec3 diffuse; // the material's colour
uniform vec3 light;   // unit vector towards the light, in eye space
uniform vec2 shading; // x: the factor of the ambient light, y: the factor of the directional light

out vec4 out_2; // colour; alpha is the share of the colour that is ambient
#endif

#ifdef TEXTURED
uniform sampler2D colour_map;
uniform vec4 colour_placed; // the factors of texture coordinates, and what is added
uniform ivec2 colour_wrap; // how u and v go on outside [0, 1]: 0 repeated, 1 by the border, 2 mirrored
#endif
#ifdef CUT
uniform sampler2D cut_map; // alpha
uniform vec4 cut_placed;
uniform ivec2 cut_wrap;
#endif

#if defined(TEXTURED) || defined(CUT)
// Returns the place in [0, 1] of a texture that is seen at x.
float wrapped(float x, int wrap)
{
    return wrap == 0 ? fract(x) : wrap == 1 ? clamp(x, 0.0, 1.0) : 1.0 - abs(mod(x, 2.0) - 1.0);
}

// Returns the texel at texture coordinates: the nearest one, after they are wrapped.
vec4 texel(sampler2D map, vec4 placed, ivec2 wrap, vec2 at)
{
    at = at * placed.xy + placed.zw;
    ivec2 size = textureSize(map, 0);
    vec2 within = vec2(wrapped(at.x, wrap.x), wrapped(at.y, wrap.y));
    return texelFetch(map, clamp(ivec2(floor(within * vec2(size))), ivec2(0), size - 1), 0);
}
#endif

// Returns v divided by the magnitude of its largest component. The result is zero if v is zero, infinite or NaN.
vec3 scaled(vec3 v)
{
    float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    return largest > 0.0 && largest <= 3.4e38 ? v / largest : vec3(0.0);
}

// Returns the unit vector along v, or `otherwise` if v has no direction because it is zero, infinite or NaN.
vec3 unit(vec3 v, vec3 otherwise)
{
    v = scaled(v);
    return v != vec3(0.0) ? normalize(v) : otherwise;
}

void main()
{
    // `plane` is the normal of the triangle's plane, from the derivatives of the position, turned towards the eye. The
    // interpolated position may lie beside the ray r through the pixel's centre, by `off_ray` in x and y.
#ifdef ORTHOGRAPHIC
    vec3 r = vec3(0.0, 0.0, 1.0);
    vec2 off_ray = position.xy - slope(gl_FragCoord.xy);
#else
    vec3 r = vec3(slope(gl_FragCoord.xy), 1.0);
    vec2 off_ray = position.xy - (near_far.x + position.z) * r.xy;
#endif
    // Both derivatives are scaled before the cross product, which then neither overflows nor underflows, whatever the
    // scene's size. Near a horizon one derivative can be millions of times as long as the other.
    vec3 plane = unit(cross(scaled(dFdx(position)), scaled(dFdy(position))), -normalize(r));
    float facing = dot(plane, r);
    if (facing > 0.0) {
        plane = -plane;
        facing = -facing;
    }

    // The depth at which the ray r meets the plane through the interpolated position Q: z = (n.Q) / (n.r). It is
    // computed as Q.z plus a correction that moves Q along the plane onto the ray.
    float z = near_far.x + (facing < 0.0 ? position.z + dot(plane.xy, off_ray) / facing : position.z);
#if defined(TEXTURED) || defined(CUT)
    // The texture coordinates where the ray r meets the plane, at `away` from the interpolated position. On the plane
    // they are linear, so that they change by as many differences to the neighbouring pixels as the position does.
    float ahead = facing < 0.0 ? dot(plane.xy, off_ray) / facing : 0.0;
    vec3 away = vec3(r.xy * ahead - off_ray, ahead);
    vec3 right = dFdx(position), up = dFdy(position);
    vec3 longest = max(abs(right), abs(up));
    float unit_length = max(max(longest.x, longest.y), longest.z);
    vec3 across = cross(right / unit_length, up / unit_length);
    vec2 steps = vec2(dot(cross(away / unit_length, up / unit_length), across),
                      dot(cross(right / unit_length, away / unit_length), across)) / dot(across, across);
    // The interpolated position is at most a few hundredths of a pixel off; if not, it is seen edge-on.
    steps = max(abs(steps.x), abs(steps.y)) < 2.0 ? steps : vec2(0.0);
    vec2 at = coordinates + steps.x * dFdx(coordinates) + steps.y * dFdy(coordinates);
#endif
#ifdef CUT
    if (texel(cut_map, cut_placed, cut_wrap, at).r < 0.5)
        discard;
#endif

    // The depth is clamped to the range of the view. It is NaN if the ray does not meet the plane; the comparison is
    // written so that NaN becomes the near depth.
    z = z > near_far.x ? min(z, near_far.y) : near_far.x;

#ifdef NORMALS_VERTEX
    vec3 n = unit(smooth_normal, plane);
    // The normal is turned to the side of the triangle that is seen. Near a silhouette it may still point away from
    // the eye.
    n = dot(n, plane) < 0.0 ? -n : n;
#else
    vec3 n = plane;
#endif

    out_0 = z;
#ifdef NORMALS_BIASED
    out_1 = vec4(0.5 * n + 0.5, 1.0);
#else
    out_1 = vec4(n, 0.0);
#endif
#ifdef COLOUR
    vec3 colour = diffuse;
#ifdef VERTEX_COLOURS
    colour *= clamp(tint, 0.0, 1.0);
#endif
#ifdef TEXTURED
    colour *= texel(colour_map, colour_placed, colour_wrap, at).rgb;
#endif
    float lit = shading.y * max(dot(n, light), 0.0);
    out_2 = vec4(colour * (shading.x + lit), shading.x / (shading.x + lit));
#endif
}
