// Depth at half the width and height, rounded up, for the samples of ssao (ShaderX7 6.1, Future improvements): texel
// (i, j) holds the full texel (2i, 2j). A surface's own depth, not a mean of several that would lie on none.
out float out_0;

void main()
{
    out_0 = depth_at(gl_FragCoord.xy);
}
