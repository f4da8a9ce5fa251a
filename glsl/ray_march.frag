// Ambient occlusion by marching rays over the depth image, which ShaderX7 6.2 gives as the brute-force method.
// The float64 twin is src/reference/ray_march.rs.
//
// Compiled in: N_D azimuths about the normal, and their unit vectors DIRECTIONS; N_R rays at each azimuth; N_S steps
// along each ray; EACH_STEP, as in shared/sampling.glsl; and FLOOR, as in hbao.frag.
out float out_0;

uniform float near; // depth of the near plane

const vec2 azimuths[N_D] = vec2[N_D](DIRECTIONS);

// One ray, projected to the image.
struct March {
    vec2 stride; // texels from one step to the next
    float start; // 1/z at P, or z when orthographic
    float rise;  // what each step adds to `start`
};

// Tests step i = 1..N_S of a ray. If a texel stops the ray, `stopped` becomes |D|^2 of that texel. Before that it is
// negative.
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
    // Texels beyond R are ignored, and so is P's own texel, where D = 0.
    bool within = squared <= s.R * s.R && sample_z < background && squared > 0.0;
    stopped = in_front && within ? squared : stopped;
#endif
}
// The steps are taken backwards, from the ray's end E to P. The last texel found in front of the ray is then the one
// nearest to P, which is the one that stops the ray.
#define MARCH_TO(i) march_to(stopped, s, march, N_S + 1 - (i));

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
    // A frame about the normal: b1 and b2 span the tangent plane. b1 is perpendicular to the x axis, or to the y axis
    // if n is close to the x axis.
    vec3 n = s.n * inversesqrt(max(dot(s.n, s.n), 1e-36));
    vec3 b1 = normalize(cross(n, abs(n.x) < 0.8 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
    vec3 b2 = cross(n, b1);

    float occlusion = 0.0;
    for (int j = 0; j < N_D; ++j) {
        vec2 a = turned(azimuths[j], s.jitter);
        vec3 azimuth = a.x * b1 + a.y * b2;
        for (int k = 0; k < N_R; ++k) {
            // Rays are uniform over the hemisphere if the cosine of their angle to the normal is uniform.
            float cosine = (float(k) + 0.5) / float(N_R);
            vec3 ray = cosine * n + sqrt(1.0 - cosine * cosine) * azimuth;
            // The ray ends at the point E, at the distance R from P or at the near plane, whichever comes first.
            float to_near = ray.z < 0.0 ? max(s.z - near, 0.0) / -ray.z : 3e38;
            float reach = min(s.R, to_near);
            // If the ray ends at the near plane, E.z is the near depth itself: computed as s.z + reach * ray.z, a small
            // near depth would be lost to rounding.
            float E_z = reach < to_near ? s.z + reach * ray.z : min(near, s.z);
            // One step covers this share of the way from P to E in the image. Along that way 1/z of the ray changes
            // linearly, or z when orthographic; `rise` is the change per step.
            const float share = 1.0 / float(N_S + 1);
#ifdef ORTHOGRAPHIC
            float start = s.z;
            float rise = share * (E_z - s.z);
            vec2 stride = share * reach * ray.xy / pixel;
#else
            float start = 1.0 / s.z;
            float end = 1.0 / E_z;
            float rise = share * (end - start);
            // The way in the image is E.xy / E.z - r = (z r + reach ray.xy) / E.z - r, rearranged so that it is not
            // the difference of two nearly equal projections.
            vec2 stride = share * reach * end * (ray.xy - ray.z * s.r) / pixel;
#endif
            March march = March(stride, start, rise);
            float stopped = -1.0;
            EACH_STEP(MARCH_TO)
            occlusion += stopped < 0.0 ? 0.0 : attenuation(stopped, s.R);
        }
    }
    out_0 = clamp(1.0 - strength / float(N_D * N_R) * occlusion, 0.0, 1.0);
}
