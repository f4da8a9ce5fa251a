// Edge detection, ShaderX7 6.2 (Multisample antialiasing): leaves the pixels whose depth samples span more than the
// blur's depth sigma, or mix surface and background. Its float64 twin is src/reference/edges.rs.
//
// Compiled in: SAMPLES.
uniform sampler2DMS depth_samples;
uniform float background; // depths from here on are background
uniform vec2 depth_sigma; // in scene units, and as a share of the depth: one of them is 0

void main()
{
    ivec2 p = ivec2(gl_FragCoord.xy);
    float nearest = texelFetch(depth_samples, p, 0).r;
    float farthest = nearest;
    for (int i = 1; i < SAMPLES; ++i) {
        float z = texelFetch(depth_samples, p, i).r;
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    bool mixed = farthest >= background && nearest < background;
    bool apart = farthest < background && farthest - nearest > depth_sigma.x + depth_sigma.y * nearest;
    if (!(mixed || apart))
        discard;
}
