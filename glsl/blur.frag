// Two blurs of ambient occlusion that respect depth. One is the cross-bilateral blur of ShaderX7 6.2, whose weights are
// Gaussian in the image and in depth. The other is the 4x4 blur of 6.1, whose taps all have the same weight.
//
// If ao_image has half the resolution, the blur also upsamples it. On edge pixels the shader runs as the supersampling
// blur: it blurs around each depth sample of the pixel and takes the mean. The float64 twin is src/reference/blur.rs.
//
// Compiled in:
//   FIRST_X, LAST_X, FIRST_Y, LAST_Y  the range of the taps, in texels of ao_image, counted from the texel that holds
//                                     the pixel
//   FROM               how many pixels in x and y one texel of ao_image stands for
//   UPSAMPLES          defined if FROM is not vec2(1)
//   GAUSSIAN, SPATIAL  the number of spatial weights, and the weights: exp(-k^2 / (2 s^2)) at k = 0, 1, ... pixels from
//                      the centre, and 0 beyond the kernel. Undefined for the blur with equal weights.
//   SIGMA_OF_DEPTH     defined if a Gaussian's depth sigma is in proportion to the depth of the pixel
//   SAMPLES            depth samples per pixel. Defined only for the supersampling blur.
uniform sampler2DRect ao_image;
uniform vec2 extent; // size of the full image in pixels
#ifdef GAUSSIAN
uniform float inverse_sigma; // 1 / (sqrt(2) s_z), where s_z is the depth sigma in scene units, or at the depth 1
const float spatial[GAUSSIAN] = float[GAUSSIAN](SPATIAL);
#else
uniform vec2 depth_sigma; // depth sigma: x in scene units, y as a share of the depth; one of the two is 0
#endif

#ifndef SAMPLES
#define SAMPLES 1
#define ONE_DEPTH
#endif
// The sum of the weights can be 0 in these two cases only. In all others the pixel's own tap has weight 1.
#if defined(UPSAMPLES) || !defined(ONE_DEPTH)
#define MAY_BE_EMPTY
#endif

out float out_0;

#ifdef GAUSSIAN
// Returns the weight of tap i, counted in texels of ao_image, along one axis. `odd` says that the pixel is the second
// of the two pixels that its texel stands for. The indices are written so that they are constant once the loops over
// the taps are unrolled; an index computed at run time is slower.
float spatial_weight(int i, float from, bool odd)
{
    return from == 1.0 ? spatial[abs(i)] : odd ? spatial[abs(2 * i - 1)] : spatial[abs(2 * i)];
}
#endif

void main()
{
    vec2 p = pixel_of(gl_FragCoord.xy);
    float z[SAMPLES], sum[SAMPLES], weights[SAMPLES], nearest[SAMPLES], distance_to[SAMPLES];
    for (int s = 0; s < SAMPLES; ++s) {
#ifdef ONE_DEPTH
        z[s] = depth_of_pixel(p);
#else
        z[s] = depth_of_sample(p, s);
#endif
        sum[s] = 0.0;
        weights[s] = 0.0;
        // A is 1 if every tap lies on background.
        nearest[s] = 1.0;
        distance_to[s] = background;
    }

    // `home` is the centre of the texel of ao_image that holds the pixel; the taps lie around it. The visibility A of a
    // texel was computed at the first of the pixels that the texel stands for. `odd` is true, for each axis, if this
    // pixel is the one after it.
    vec2 home = floor(p / FROM) + 0.5;
    bvec2 odd = notEqual(p, FROM * (home - 0.5) + 0.5);
#ifndef GAUSSIAN
    // The 4x4 taps are not symmetric: two lie before `home` and one after it. For odd pixels the taps are therefore
    // taken around the next texel. On average the blur from half resolution is then shifted no further than the one at
    // full resolution.
    home += vec2(odd);
#endif
    vec2 home_pixel = FROM * (home - 0.5) + 0.5;
    for (int y = FIRST_Y; y <= LAST_Y; ++y)
    for (int x = FIRST_X; x <= LAST_X; ++x) {
        vec2 offset = vec2(x, y);
        // The depth of a tap is the depth of the pixel at which its A was computed.
        vec2 q = home_pixel + FROM * offset;
        float tap_z = depth_of_pixel(q);
        float A = texture(ao_image, home + offset).r;
#ifdef GAUSSIAN
        float weight = spatial_weight(x, FROM.x, odd.x) * spatial_weight(y, FROM.y, odd.y);
#else
        float weight = 1.0;
#endif
        // Taps on background and outside the image have no weight.
        if (tap_z >= background || q != clamp(q, vec2(0.5), extent - 0.5))
            weight = 0.0;
        for (int s = 0; s < SAMPLES; ++s) {
            float dz = tap_z - z[s];
#ifdef GAUSSIAN
#ifdef SIGMA_OF_DEPTH
            // Divided first, so that a tiny sigma does not become 0 times infinity.
            float t = dz / z[s] * inverse_sigma;
#else
            float t = dz * inverse_sigma;
#endif
            float of_depth = weight * exp(-t * t);
#else
            float of_depth = abs(dz) <= depth_sigma.x + depth_sigma.y * z[s] ? weight : 0.0;
#endif
            sum[s] += of_depth * A;
            weights[s] += of_depth;
#ifdef MAY_BE_EMPTY
            if (weight > 0.0 && abs(dz) < distance_to[s]) {
                nearest[s] = A;
                distance_to[s] = abs(dz);
            }
#endif
        }
    }

    float total = 0.0;
    for (int s = 0; s < SAMPLES; ++s) {
#ifdef MAY_BE_EMPTY
        float A = weights[s] < 1e-6 ? nearest[s] : sum[s] / weights[s];
        total += z[s] < background ? A : 1.0;
#else
        total += sum[s] / weights[s];
#endif
    }
    out_0 = total / float(SAMPLES);
}
