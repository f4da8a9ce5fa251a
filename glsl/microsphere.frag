// Micro-spheres (Shanmugam and Arikan 2007) and creases (Fox and Compton 2008) as ShaderX7 6.2 describes them. Every
// sample within R occludes by its solid angle, even where other samples hide it from P.
// The float64 twin is src/reference/microsphere.rs.
//
// Compiled in, in addition to what the shared pieces list: CREASE, if every sample has the same solid angle; and FLOOR,
// as in hbao.frag.
out float out_0;

const float PI = 3.14159265358979;

// Returns the occlusion of the surface s, whose unit normal is n, by sample i = 1..N_S.
float occlusion_by(Surface s, vec3 n, Direction d, Steps steps, int i)
{
    Sample S = sample_at(s, d, i);
#ifdef FLOOR
    return S.z;
#else
    float inverse = inversesqrt(S.squared);
#ifdef CREASE
    float solid_angles = 2.0 * PI / (float(N_D) * steps.count);
#else
    // The sample stands for m texels. Each holds a sphere of radius rho, as wide as a texel is at the sample's depth,
    // and of the solid angle Omega = 2 pi cap, seen from P.
#ifdef ORTHOGRAPHIC
    float rho = 0.5 * pixel.y;
#else
    float rho = 0.5 * S.z * pixel.y;
#endif
    float sine = min(1.0, rho * inverse);
    // cap = 1 - sqrt(1 - sine^2), in a form that does not cancel if the sine is small.
    float cap = sine * sine / (1.0 + sqrt(1.0 - sine * sine));
    float m = 2.0 * PI * (s.jitter.z + float(i)) * steps.px.x * steps.px.y / float(N_D);
    float solid_angles = m * 2.0 * PI * cap;
#endif
    return within(S, s) ? solid_angles * max(0.0, dot(n, S.D) * inverse) : 0.0;
#endif
}
#define ADD(i) occlusion += occlusion_by(s, n, d, steps, i);

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
    Steps steps = steps_at(s);
    if (steps.exits) {
        out_0 = 1.0;
        return;
    }

    vec3 n = s.n * inversesqrt(max(dot(s.n, s.n), 1e-36));
    float occlusion = 0.0;
    for (int k = 0; k < direction_count; ++k) {
        Direction d = direction(k, steps.px, s.jitter);
        EACH_STEP(ADD)
    }
    out_0 = clamp(1.0 - strength / PI * occlusion, 0.0, 1.0);
}
