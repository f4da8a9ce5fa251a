// Horizon-based ambient occlusion, ShaderX7 6.2, Eq. 6.2.9. Its float64 twin is src/reference/hbao.rs.
//
// Compiled in, beside what the shared pieces say: BIAS, and one each of ATTENUATION_*, GROUNDING_*. FLOOR keeps every
// fetch of depth and replaces what is computed from it by a sum: the least that this sampling can cost.
out float out_0;

// One direction's horizon, as far as it has been followed.
struct Horizon {
    float sine;
    float tangent;   // the sine of t(theta), or of the sample's own t_i
    float previous;  // by how much the last sample accepted rose over it
    float occlusion; // the sum of Eq. 6.2.9
};

// Sample i = 1..N_S.
void look_at(inout Horizon h, Surface s, Direction d, int i)
{
    Sample S = sample_at(s, d, i);
#ifdef FLOOR
    h.occlusion += S.z;
#else
    // Eq. 6.2.6, as a sine: it orders samples as the tangent does.
    float sine = -S.D.z * inversesqrt(S.squared);
    bool accepted = within(S) && sine > h.sine;
    // Eq. 6.2.9, or with the direction's tangent Eq. 6.2.8.
#ifdef GROUNDING_SAMPLE
    h.tangent = sine_of_tangent(s, S.taken * pixel);
#endif
    float rise = sine - h.tangent;
    // Chosen rather than branched over: llvmpipe takes less time so.
    h.occlusion += accepted ? attenuation(S.squared) * (rise - h.previous) : 0.0;
    h.previous = accepted ? rise : h.previous;
    h.sine = accepted ? sine : h.sine;
#endif
}
#define LOOK_AT(i) look_at(h, s, d, i);

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
    vec2 step_px = step_in_texels(s);
    if (min(step_px.x, step_px.y) < 1.0) {
        out_0 = 1.0;
        return;
    }

    float occlusion = 0.0;
    for (int k = 0; k < N_D; ++k) {
        Direction d = direction(k, step_px, s.jitter);
        // The horizon starts at the tangent, t(theta).
        float tangent = sine_of_tangent(s, along(d) * pixel);
        Horizon h = Horizon(tangent, tangent, 0.0, 0.0);
        EACH_STEP(LOOK_AT)
        occlusion += h.occlusion;
    }
    out_0 = clamp(1.0 - strength / float(N_D) * occlusion, 0.0, 1.0);
}
