// Depth at half the width and height, rounded up, for the samples of ssao (ShaderX7 6.1, Future improvements). Texel
// (i, j) is a copy of the full image's texel (2i, 2j). A mean of several texels would be a depth at which there is no
// surface.
out float out_0;

void main()
{
    out_0 = depth_at(gl_FragCoord.xy);
}
