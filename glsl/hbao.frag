// Horizon-based ambient occlusion, ShaderX7 6.2, Eq. 6.2.9. The output is the visibility A, 1 where nothing occludes.
// The float64 twin is src/reference/hbao.rs.
//
// Compiled in, in addition to what the shared pieces list: BIAS, if the angle bias is above 0; one of ATTENUATION_*;
// and one of GROUNDING_*. FLOOR is for measurements: every depth is still fetched, but a sum of the depths replaces the
// arithmetic. The time of the resulting shader, the fetch floor, is the least that this sampling can cost.
out float out_0;

// The horizon of one direction, after the samples taken so far.
struct Horizon {
    float sine;      // sine of the horizon's elevation
    float tangent;   // sine of t(theta), the direction's tangent, or of t_i, the tangent towards the last sample
    float previous;  // the last accepted sample's sine minus the tangent's
    float occlusion; // the sum of Eq. 6.2.9 so far
};

// Updates the horizon and the occlusion by sample i = 1..N_S.
void look_at(inout Horizon h, Surface s, Direction d, int i)
{
    Sample S = sample_at(s, d, i);
#ifdef FLOOR
    h.occlusion += S.z;
#else
    // Eq. 6.2.6 is the elevation's tangent. This is the elevation's sine, which orders the samples in the same way.
    float sine = -S.D.z * inversesqrt(S.squared);
    bool accepted = within(S, s) && sine > h.sine;
    // Eq. 6.2.9 uses the tangent towards each sample. Eq. 6.2.8 uses one tangent for the whole direction.
#ifdef GROUNDING_SAMPLE
    h.tangent = sine_of_tangent(s, S.taken * pixel);
#endif
    float rise = sine - h.tangent;
    // These are selections and not a branch, because llvmpipe takes less time that way.
    h.occlusion += accepted ? attenuation(S.squared, s.R) * (rise - h.previous) : 0.0;
    h.previous = accepted ? rise : h.previous;
    h.sine = accepted ? sine : h.sine;
#endif
}
#define LOOK_AT(i) look_at(h, s, d, i);

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
    Steps steps = steps_at(s);
    if (steps.exits) {
        out_0 = 1.0;
        return;
    }

    float occlusion = 0.0;
    for (int k = 0; k < direction_count; ++k) {
        Direction d = direction(k, steps.px, s.jitter);
        // The horizon starts at the direction's tangent, t(theta).
        float tangent = sine_of_tangent(s, along(d) * pixel);
        Horizon h = Horizon(tangent, tangent, 0.0, 0.0);
        EACH_STEP(LOOK_AT)
        occlusion += h.occlusion;
    }
    out_0 = clamp(1.0 - strength / float(N_D) * occlusion, 0.0, 1.0);
}
