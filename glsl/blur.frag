// The cross-bilateral blur, ShaderX7 6.2: Gaussian in the image and in depth; and the 4x4 blur of 6.1, of equal
// weights. From half resolution it upsamples; on edge pixels it is the supersampling blur, around each depth sample of
// the pixel. Its float64 twin is src/reference/blur.rs.
//
// Compiled in:
//   FIRST_X, LAST_X, FIRST_Y, LAST_Y  the taps, in texels of ao_image from the one that holds the pixel
//   FROM    how many pixels in x and y a texel of ao_image stands for; UPSAMPLES where not 1 and 1
//   GAUSSIAN, SPATIAL  weights exp(-k^2 / (2 s^2)) at k = 0, 1, ... pixels from the centre, 0 beyond the kernel;
//           without, all weigh the same
//   SAMPLES the depth samples of a pixel, where the blur is around each of them
uniform sampler2DRect ao_image;
uniform vec2 extent; // of the full image, in pixels
#ifdef GAUSSIAN
uniform float inverse_sigma; // 1 / (sqrt(2) s_z), of the depth sigma in scene units
const float spatial[GAUSSIAN] = float[GAUSSIAN](SPATIAL);
#else
uniform vec2 depth_sigma; // in scene units, and as a share of the depth: one of them is 0
#endif

#ifdef SAMPLES
uniform sampler2DMS depth_samples;
#else
#define SAMPLES 1
#define ONE_DEPTH
#endif
// Elsewhere the centre weighs 1.
#if defined(UPSAMPLES) || !defined(ONE_DEPTH)
#define MAY_BE_EMPTY
#endif

out float out_0;

#ifdef GAUSSIAN
// Weight of tap i of a row or column, in texels of ao_image; odd: whether the pixel is the second that its texel stands
// for. An index that is known before it runs is faster than one that is computed.
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
        z[s] = texelFetch(depth_samples, ivec2(p), s).r;
#endif
        sum[s] = 0.0;
        weights[s] = 0.0;
        // Where nothing but background is near, A is 1.
        nearest[s] = 1.0;
        distance_to[s] = background;
    }

    // The texel of ao_image that holds the pixel, about which the taps lie, and whether it stands for another one.
    vec2 home = floor(p / FROM) + 0.5;
    bvec2 odd = notEqual(p, FROM * (home - 0.5) + 0.5);
#ifndef GAUSSIAN
    // Of an even number of taps more lie to one side. About the texel to the right of a pixel that is the second of its
    // texel, half resolution lies on the whole no further to that side than full.
    home += vec2(odd);
#endif
    vec2 home_pixel = FROM * (home - 0.5) + 0.5;
    for (int y = FIRST_Y; y <= LAST_Y; ++y)
    for (int x = FIRST_X; x <= LAST_X; ++x) {
        vec2 offset = vec2(x, y);
        // A tap's depth is that of the pixel where its A was computed.
        vec2 q = home_pixel + FROM * offset;
        float tap_z = depth_of_pixel(q);
        float A = texture(ao_image, home + offset).r;
#ifdef GAUSSIAN
        float weight = spatial_weight(x, FROM.x, odd.x) * spatial_weight(y, FROM.y, odd.y);
#else
        float weight = 1.0;
#endif
        // Taps on background and outside the image weigh nothing.
        if (tap_z >= background || q != clamp(q, vec2(0.5), extent - 0.5))
            weight = 0.0;
        for (int s = 0; s < SAMPLES; ++s) {
            float dz = tap_z - z[s];
#ifdef GAUSSIAN
            float t = dz * inverse_sigma;
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
