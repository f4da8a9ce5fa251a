// Micro-spheres (Shanmugam and Arikan 2007) and creases (Fox and Compton 2008) as ShaderX7 6.2 describes them: every
// sample within R occludes by its solid angle, whatever stands before it. The float64 twin is
// src/reference/microsphere.rs.
//
// Compiled in: CREASE, where every sample has the same solid angle.
out float out_0;

const float PI = 3.14159265358979;

// What sample i = 1..N_S occludes, about the unit normal n.
float occlusion_by(Surface s, vec3 n, Direction d, vec2 step_px, int i)
{
    Sample S = sample_at(s, d, i);
#ifdef FLOOR
    return S.z;
#else
    float inverse = inversesqrt(S.squared);
#ifdef CREASE
    const float solid_angles = 2.0 * PI / float(N_D * N_S);
#else
    // The sphere that a texel's pixel is wide: its radius rho, its solid angle Omega, and the m texels that the sample
    // stands for.
#ifdef ORTHOGRAPHIC
    float rho = 0.5 * pixel.y;
#else
    float rho = 0.5 * S.z * pixel.y;
#endif
    float sine = min(1.0, rho * inverse);
    // 1 - sqrt(1 - x), without its cancellation where x is small.
    float cap = sine * sine / (1.0 + sqrt(1.0 - sine * sine));
    float m = 2.0 * PI * (s.jitter.z + float(i)) * step_px.x * step_px.y / float(N_D);
    float solid_angles = m * 2.0 * PI * cap;
#endif
    return within(S) ? solid_angles * max(0.0, dot(n, S.D) * inverse) : 0.0;
#endif
}
#define ADD(i) occlusion += occlusion_by(s, n, d, step_px, i);

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
    vec2 step_px = step_in_texels(s);
    if (min(step_px.x, step_px.y) < 1.0) {
        out_0 = 1.0;
        return;
    }

    vec3 n = s.n * inversesqrt(max(dot(s.n, s.n), 1e-36));
    float occlusion = 0.0;
    for (int k = 0; k < N_D; ++k) {
        Direction d = direction(k, step_px, s.jitter);
        EACH_STEP(ADD)
    }
    out_0 = clamp(1.0 - strength / PI * occlusion, 0.0, 1.0);
}
