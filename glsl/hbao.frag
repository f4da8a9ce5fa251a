// Horizon-based ambient occlusion, ShaderX7 6.2, Eq. 6.2.9. Its float64 twin is src/reference/hbao.rs.
//
// Compiled in: N_D, N_S, DIRECTIONS (the N_D unit vectors at angles 2 pi k / N_D), ORTHOGRAPHIC, BIAS,
// JITTER_TILE, and one each of ATTENUATION_*, SNAP_*, CLAMP_*, GROUNDING_*. FLOOR keeps every fetch
// of depth and replaces what is computed from it by a sum: the least that this sampling can cost.
#ifdef NORMALS_RECTANGLE
uniform sampler2DRect normal_image;
vec3 stored_normal(vec2 p) { return texture(normal_image, p).xyz; }
#else
uniform sampler2D normal_image;
vec3 stored_normal(vec2 p) { return textureLod(normal_image, p * texel, 0.0).xyz; }
#endif

uniform sampler2DRect tile; // 4x4: cos a, sin a, b
uniform float radius;       // R, scene units
uniform float strength;
uniform vec2 bias;          // cosine, sine

out float out_0;

const vec2 directions[N_D] = vec2[N_D](DIRECTIONS);

// The sine of the elevation of the tangent T = du dP/dx' + dv dP/dy' (Eq. 6.2.11), lateral = (du, dv), raised by the
// angle bias to at most 90 degrees. dP/dx' = z (e_x - r n.x / (n.r)); T is taken times -(n.r) / z, which is positive
// and spares the division where the surface is seen edge-on.
float sine_of_tangent(vec2 lateral, vec2 r, vec3 n, float facing)
{
    float rise = dot(n.xy, lateral);
    vec3 T = vec3(facing * lateral + rise * r, rise);
    float inverse = inversesqrt(max(dot(T, T), 1e-36));
    float s = -T.z * inverse;
#ifdef BIAS
    float c = dot(T, T) > 0.0 ? length(T.xy) * inverse : 1.0;
    s = s > bias.x ? 1.0 : s * bias.x + c * bias.y;
#endif
    return s;
}

void main()
{
    vec2 p = gl_FragCoord.xy;
    float z = depth_at(p);

    // R in texels, divided into steps (6.2, Variable step size).
#ifdef ORTHOGRAPHIC
    vec2 r = vec2(0.0);
    vec2 step_px = radius / (pixel * float(N_S + 1));
#else
    vec2 r = slope(p);
    vec2 step_px = radius / (z * pixel * float(N_S + 1));
#endif
    if (min(step_px.x, step_px.y) < 1.0) {
        out_0 = 1.0;
        return;
    }

    vec3 n = stored_normal(p);
#ifdef NORMALS_BIASED
    n = 2.0 * n - 1.0;
#endif
    // The tangent plane is the same for n and -n.
    float facing = -dot(n, vec3(r, 1.0));
    if (facing < 0.0) {
        facing = -facing;
        n = -n;
    }

#ifdef JITTER_TILE
    vec3 jitter = texture(tile, mod(floor(p), 4.0) + 0.5).xyz;
#else
    const vec3 jitter = vec3(1.0, 0.0, 0.0);
#endif

    float occlusion = 0.0;
    for (int k = 0; k < N_D; ++k) {
        // Eq. 6.2.10: the direction turned by a.
        vec2 d = vec2(directions[k].x * jitter.x - directions[k].y * jitter.y,
                      directions[k].y * jitter.x + directions[k].x * jitter.y);
        vec2 stride = step_px * d;
#ifdef SNAP_STEP
        vec2 first = floor(jitter.z * stride + 0.5);
        stride = floor(stride + 0.5);
#endif
        // The horizon starts at the tangent, t(theta). Only the stride's direction matters, and its length may be
        // past what can be squared.
        vec2 unit = stride / max(abs(stride.x), abs(stride.y));
        float tangent = sine_of_tangent(unit * pixel, r, n, facing);
        float horizon = tangent;
        float previous = 0.0;
        for (int i = 1; i <= N_S; ++i) {
#ifdef SNAP_STEP
            vec2 offset = first + float(i) * stride;
#else
            vec2 exact = (jitter.z + float(i)) * stride;
            vec2 offset = floor(exact + 0.5);
#endif
            vec2 q = clamp(p + offset, vec2(0.5), size - 0.5);
            float sample_z = depth_at(q);
#ifdef FLOOR
            occlusion += sample_z;
#else
            vec2 taken = q - p;
            // Where the sample is taken to lie, in texels from p.
#if defined(SNAP_NONE) && defined(CLAMP_POSITION)
            vec2 at = taken == offset ? exact : taken;
#elif defined(SNAP_NONE)
            vec2 at = exact;
#elif defined(CLAMP_POSITION)
            vec2 at = taken;
#else
            vec2 at = offset;
#endif
            // D = S - P, without subtracting two far positions: z_s (r + at) - z r = (z_s - z) r + z_s at.
            float dz = sample_z - z;
#ifdef ORTHOGRAPHIC
            vec3 D = vec3(at * pixel, dz);
#else
            vec3 D = vec3(dz * r + sample_z * (at * pixel), dz);
#endif
            float squared = dot(D, D);
            // Eq. 6.2.6, as a sine: it orders samples as the tangent does.
            float sine = -dz * inversesqrt(squared);
            bool within = squared <= radius * radius && sample_z < background;
            bool accepted = within && sine > horizon && taken != vec2(0.0);
            // Eq. 6.2.9, or with the direction's tangent Eq. 6.2.8.
#ifdef GROUNDING_SAMPLE
            tangent = sine_of_tangent(taken * pixel, r, n, facing);
#endif
            float rise = sine - tangent;
#if defined(ATTENUATION_QUADRATIC)
            float W = 1.0 - squared / (radius * radius);
#elif defined(ATTENUATION_LINEAR)
            float W = 1.0 - sqrt(squared) / radius;
#else
            const float W = 1.0;
#endif
            // Chosen rather than branched over: a sixth less time on llvmpipe.
            occlusion += accepted ? W * (rise - previous) : 0.0;
            previous = accepted ? rise : previous;
            horizon = accepted ? sine : horizon;
#endif
        }
    }
    out_0 = clamp(1.0 - strength / float(N_D) * occlusion, 0.0, 1.0);
}
