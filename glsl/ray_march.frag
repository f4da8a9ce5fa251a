// Ambient occlusion by marching rays over the depth image: ShaderX7 6.2's brute force. Its float64 twin is
// src/reference/ray_march.rs.
//
// Compiled in: N_D azimuths about the normal and their unit vectors (DIRECTIONS), N_R rays at each, N_S steps along each.
out float out_0;

uniform float near;

const vec2 azimuths[N_D] = vec2[N_D](DIRECTIONS);

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
#ifdef ORTHOGRAPHIC
    vec3 P = vec3(slope(s.p), s.z);
#else
    vec3 P = s.z * vec3(s.r, 1.0);
#endif
    // A frame about the normal: b1 and b2 span the tangent plane, b1 across the axis that n leans on less.
    vec3 n = s.n * inversesqrt(max(dot(s.n, s.n), 1e-36));
    vec3 b1 = normalize(cross(n, abs(n.x) < 0.8 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
    vec3 b2 = cross(n, b1);

    float occlusion = 0.0;
    for (int j = 0; j < N_D; ++j) {
        vec2 a = turned(azimuths[j], s.jitter);
        vec3 azimuth = a.x * b1 + a.y * b2;
        for (int k = 0; k < N_R; ++k) {
            // Uniform over the hemisphere: the zenith's cosine is uniform.
            float cosine = (float(k) + 0.5) / float(N_R);
            vec3 ray = cosine * n + sqrt(1.0 - cosine * cosine) * azimuth;
            // The end point E, at distance R or at the near plane.
            float reach = ray.z < 0.0 ? min(radius, max(s.z - near, 0.0) / -ray.z) : radius;
            vec3 E = P + reach * ray;
#ifdef ORTHOGRAPHIC
            vec2 across = (E.xy - P.xy) / pixel;
#else
            vec2 across = (E.xy / E.z - s.r) / pixel;
#endif
            bool hit = false;
            for (int i = 1; i <= N_S; ++i) {
                float along = (s.jitter.z + float(i)) / float(N_S + 1);
                vec2 q = clamp(s.p + floor(along * across + 0.5), vec2(0.5), size - 0.5);
                float sample_z = depth_at(q);
#ifdef FLOOR
                occlusion += sample_z;
#else
                // The ray's own depth there: 1/z is linear in the image, z itself when orthographic.
                vec2 taken = q - s.p;
                vec3 D = from_surface(s, taken, sample_z);
#ifdef ORTHOGRAPHIC
                float ray_z = mix(s.z, E.z, along);
#else
                float ray_z = s.z * E.z / mix(E.z, s.z, along);
#endif
                float squared = dot(D, D);
                // The first texel in front of the ray stops it; those beyond R are passed over.
                bool within = squared <= radius * radius && sample_z < background && taken != vec2(0.0);
                bool stops = !hit && sample_z < ray_z && within;
                occlusion += stops ? attenuation(squared) : 0.0;
                hit = hit || stops;
#endif
            }
        }
    }
    out_0 = clamp(1.0 - strength / float(N_D * N_R) * occlusion, 0.0, 1.0);
}
