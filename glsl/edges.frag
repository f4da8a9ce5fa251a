// Edge detection, ShaderX7 6.2 (Multisample antialiasing). A pixel is an edge if its depth samples span more than the
// blur's depth sigma, or if some lie on a surface and some on background. All other pixels are discarded. The float64
// twin is src/reference/edges.rs.
//
// Compiled in: SAMPLES, the depth samples per pixel.
uniform vec2 depth_sigma; // depth sigma: x in scene units, y as a share of the depth; one of the two is 0

void main()
{
    vec2 p = gl_FragCoord.xy;
    float nearest = depth_of_sample(p, 0);
    float farthest = nearest;
    for (int i = 1; i < SAMPLES; ++i) {
        float z = depth_of_sample(p, i);
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    bool mixed = farthest >= background && nearest < background;
    bool apart = farthest < background && farthest - nearest > depth_sigma.x + depth_sigma.y * nearest;
    if (!(mixed || apart))
        discard;
}
