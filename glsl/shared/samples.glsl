// The depth samples of a pixel, as linear depth. A depth buffer's own values are made linear as they are fetched: a
// pixel's samples are read once by each pass that needs them, so that an image of linear samples would only be read and
// written in addition.
//
// Compiled in: what hardware.glsl lists; and SAMPLES_VIEWPORT, if the samples are a part of a larger texture.
uniform sampler2DMS depth_samples;

float depth_of_sample(vec2 p, int i)
{
#ifdef SAMPLES_VIEWPORT
    p = in_viewport(p);
#endif
    return linear_depth(texelFetch(depth_samples, ivec2(p), i).r);
}
