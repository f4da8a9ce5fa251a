// Turns multisample textures into textures with one value per pixel (ShaderX7 6.2, Multisample antialiasing). Depth and
// normal are those of one sample, since a mean of several would belong to no surface. Colour is the mean of all
// samples.
//
// Compiled in: SAMPLES, the samples per pixel; COLOUR if an image needs the colour.
uniform sampler2DMS depth_samples;
uniform sampler2DMS normal_samples;
uniform int which; // the index of the sample whose depth and normal are kept

out float out_0; // linear depth
out vec4 out_1; // normal
#ifdef COLOUR
uniform sampler2DMS colour_samples;

out vec4 out_2; // colour
#endif

void main()
{
    ivec2 p = ivec2(gl_FragCoord.xy);
    out_0 = texelFetch(depth_samples, p, which).r;
    out_1 = texelFetch(normal_samples, p, which);
#ifdef COLOUR
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SAMPLES; ++i)
        sum += texelFetch(colour_samples, p, i);
    out_2 = sum / float(SAMPLES);
#endif
}
