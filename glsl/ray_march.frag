// Ambient occlusion by marching rays over the depth image: ShaderX7 6.2's brute force. Its float64 twin is
// src/reference/ray_march.rs.
//
// Compiled in: N_D azimuths about the normal and their unit vectors (DIRECTIONS), N_R rays at each, N_S steps along
// each and EACH_STEP, as shared/sampling.glsl has it.
out float out_0;

uniform float near;

const vec2 azimuths[N_D] = vec2[N_D](DIRECTIONS);

// One ray in the image: texels from a step to the next, and the ray's own z or 1/z, from P on and by how much it rises
// with each step.
struct March {
    vec2 stride;
    float start;
    float rise;
};

// Step i = 1..N_S of a ray. `stopped` is |D|^2 where a texel stops it, and below 0 where none has.
void march_to(inout float stopped, Surface s, March ray, int i)
{
    float along = s.jitter.z + float(i);
    vec2 q = clamp(s.p + floor(along * ray.stride + 0.5), vec2(0.5), size - 0.5);
    float sample_z = depth_at(q);
#ifdef FLOOR
    stopped += sample_z;
#else
    float way = ray.start + along * ray.rise;
#ifdef ORTHOGRAPHIC
    bool in_front = sample_z < way;
#else
    bool in_front = sample_z * way < 1.0;
#endif
    vec3 D = from_surface(s, q - s.p, sample_z);
    float squared = dot(D, D);
    // Texels beyond R are passed over, and P's own, at D = 0.
    bool within = squared <= radius * radius && sample_z < background && squared > 0.0;
    stopped = in_front && within ? squared : stopped;
#endif
}
// From E to P, so that the texel that is kept is the first one in front of the ray: it stops the ray.
#define MARCH_TO(i) march_to(stopped, s, march, N_S + 1 - (i));

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
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
            float to_near = ray.z < 0.0 ? max(s.z - near, 0.0) / -ray.z : 3e38;
            float reach = min(radius, to_near);
            // Not by way of P.z where it ends at the near plane: of a small near nothing would be left.
            float E_z = reach < to_near ? s.z + reach * ray.z : min(near, s.z);
            // A step is this share of the way to E's projection, and the ray's own depth changes by `rise`: 1/z is
            // linear in the image, z itself when orthographic.
            const float share = 1.0 / float(N_S + 1);
#ifdef ORTHOGRAPHIC
            float start = s.z;
            float rise = share * (E_z - s.z);
            vec2 stride = share * reach * ray.xy / pixel;
#else
            float start = 1.0 / s.z;
            float end = 1.0 / E_z;
            float rise = share * (end - start);
            // E.xy / E.z - r, without subtracting two projections: (z r + reach ray.xy) / E.z - r.
            vec2 stride = share * reach * end * (ray.xy - ray.z * s.r) / pixel;
#endif
            March march = March(stride, start, rise);
            float stopped = -1.0;
            EACH_STEP(MARCH_TO)
            occlusion += stopped < 0.0 ? 0.0 : attenuation(stopped);
        }
    }
    out_0 = clamp(1.0 - strength / float(N_D * N_R) * occlusion, 0.0, 1.0);
}
