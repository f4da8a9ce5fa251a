// One sample of depth and normal, and the mean of the colours: multisample textures made plain (ShaderX7 6.2,
// Multisample antialiasing).
//
// Compiled in: SAMPLES.
uniform sampler2DMS colour_samples;
uniform sampler2DMS depth_samples;
uniform sampler2DMS normal_samples;
uniform int which; // the sample of depth and normal

out vec4 out_0; // colour
out float out_1; // linear depth
out vec4 out_2; // normal

void main()
{
    ivec2 p = ivec2(gl_FragCoord.xy);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < SAMPLES; ++i)
        sum += texelFetch(colour_samples, p, i);
    out_0 = sum / float(SAMPLES);
    out_1 = texelFetch(depth_samples, p, which).r;
    out_2 = texelFetch(normal_samples, p, which);
}
