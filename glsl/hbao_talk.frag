// Horizon-based ambient occlusion as the SIGGRAPH 2008 talk has it, Eq. 3. Each direction has one horizon and one
// attenuation, which is that of the sample at the horizon. The float64 twin is src/reference/hbao_talk.rs.
//
// Compiled in: what the shared pieces list, BIAS, one of ATTENUATION_*, and FLOOR as in hbao.frag.
out float out_0;

// The horizon of one direction, h(theta): the highest of the tangent and the samples within R.
struct Horizon {
    float sine;    // sine of the horizon's elevation
    float squared; // |D|^2 of the sample at the horizon; 0 as long as the tangent is the horizon
};

// Raises the horizon to sample i = 1..N_S, if that is higher.
void look_at(inout Horizon h, Surface s, Direction d, int i)
{
    Sample S = sample_at(s, d, i);
#ifdef FLOOR
    h.sine += S.z;
#else
    float sine = -S.D.z * inversesqrt(S.squared);
    bool higher = within(S, s) && sine > h.sine;
    h.sine = higher ? sine : h.sine;
    h.squared = higher ? S.squared : h.squared;
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
        float tangent = sine_of_tangent(s, along(d) * pixel);
        Horizon h = Horizon(tangent, 0.0);
        EACH_STEP(LOOK_AT)
        occlusion += (h.sine - tangent) * attenuation(h.squared, s.R);
    }
    out_0 = clamp(1.0 - strength / float(N_D) * occlusion, 0.0, 1.0);
}
