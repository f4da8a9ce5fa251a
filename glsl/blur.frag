// The cross-bilateral blur, ShaderX7 6.2: Gaussian in the image and in depth. Its float64 twin is
// src/reference/blur.rs.
//
// Compiled in: RADIUS (the kernel is 2 RADIUS + 1 wide), SPATIAL (the RADIUS + 1 weights exp(-k^2 / (2 s^2)) from the
// centre out), and one of KERNEL_X, KERNEL_Y, KERNEL_FULL.
uniform sampler2DRect ao_image;
uniform vec2 size;
uniform float inverse_2_sigma_squared; // 1 / (2 s_z^2), of the depth sigma in scene units

out float out_0;

const float spatial[RADIUS + 1] = float[RADIUS + 1](SPATIAL);

void main()
{
    vec2 p = gl_FragCoord.xy;
    float z = depth_at(p);
    float sum = 0.0;
    float weights = 0.0;
#ifdef KERNEL_FULL
    for (int y = -RADIUS; y <= RADIUS; ++y)
#endif
    for (int k = -RADIUS; k <= RADIUS; ++k) {
#if defined(KERNEL_X)
        vec2 offset = vec2(k, 0);
        float weight = spatial[abs(k)];
#elif defined(KERNEL_Y)
        vec2 offset = vec2(0, k);
        float weight = spatial[abs(k)];
#else
        vec2 offset = vec2(k, y);
        float weight = spatial[abs(k)] * spatial[abs(y)];
#endif
        vec2 q = p + offset;
        float tap_z = depth_at(q);
        float dz = tap_z - z;
        weight *= exp(-dz * dz * inverse_2_sigma_squared);
        // Taps on background and outside the image weigh nothing.
        if (tap_z >= background || q != clamp(q, vec2(0.5), size - 0.5))
            weight = 0.0;
        sum += weight * texture(ao_image, q).r;
        weights += weight;
    }
    // The centre weighs 1: this pass runs on surfaces only.
    out_0 = sum / weights;
}
