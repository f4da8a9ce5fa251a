// Screen-space ambient occlusion as Crysis has it, ShaderX7 6.1: the share of open space among points about P. Its
// float64 twin is src/reference/ssao.rs.
//
// Compiled in: N_SAMPLES and their LENGTHS l_i, one of ROTATION_*, and where they are on HALF_DEPTH, NORMALS, CURVE.
// FLOOR keeps every fetch of depth and replaces what is computed from it by a sum.
out float out_0;

#ifdef HALF_DEPTH
uniform sampler2DRect half_depth_image;
// The pixel x reads the half texel floor(x / 2): half of a centre lies a quarter off that texel's border.
float sample_depth_at(vec2 q) { return texture(half_depth_image, 0.5 * pixel_of(q)).r; }
#else
float sample_depth_at(vec2 q) { return depth_at(q); }
#endif

const float lengths[N_SAMPLES] = float[N_SAMPLES](LENGTHS);

// Randomly rotated kernel: the columns that turn an offset by the tile's vector.
mat3 turned_by(vec3 v)
{
#ifdef ROTATION_MIRROR
    // Future improvements: mirrored at the plane with normal v, o - 2 (o.v) v.
    return mat3(1.0) - 2.0 * outerProduct(v, v);
#else
    // The rotation that carries (0, 0, 1) to v. v.z >= 0 in the tile, so h is never singular.
    float h = 1.0 / (1.0 + v.z);
    return mat3(h * v.y * v.y + v.z, -h * v.x * v.y, -v.x,
                -h * v.x * v.y, h * v.x * v.x + v.z, -v.y,
                v);
#endif
}

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
#ifdef JITTER_TILE
    mat3 turn = turned_by(s.jitter);
#else
    mat3 turn = turned_by(vec3(0.0, 0.0, 1.0));
#endif

    // SSAO pixel shader: offsets are a cube's corners, x outermost and z innermost, of lengths l_i. Two corners lie on
    // a diagonal, so four are turned, once for all octets. In texels, and depth by 2 P.z.
    vec3 scale = vec3(extent, 2.0 * s.z) * inversesqrt(3.0);
    vec3 diagonals[4] = vec3[4](scale * (turn[0] + turn[1] + turn[2]), scale * (turn[0] + turn[1] - turn[2]),
                                scale * (turn[0] - turn[1] + turn[2]), scale * (turn[0] - turn[1] - turn[2]));

    float accessibility = 0.0;
    for (int i = 0; i < N_SAMPLES; ++i) {
        int corner = i % 8;
        vec3 diagonal = diagonals[min(corner, 7 - corner)];
        float along = corner < 4 ? -lengths[i] : lengths[i];
#ifdef NORMALS
        // Future improvements: no sample behind the surface. The sign of n.(Q - P) decides, Q the point at the sample's
        // depth on the ray through its position; in perspective it is taken over P.z.
        float rise = dot(s.n.xy, diagonal.xy * pixel);
#ifdef ORTHOGRAPHIC
        float towards = along * (rise - diagonal.z * s.facing);
#else
        float dz = diagonal.z / s.z;
        float towards = along * (rise + along * dz * rise - dz * s.facing);
#endif
        along = towards < 0.0 ? -along : along;
#endif
        vec3 offset = along * diagonal;
        // The nearest texel. Beyond the border the sampler clamps, but to pixels, of which a texel may be several.
        vec2 q = s.p + floor(offset.xy + 0.5);
#ifdef SCALE
        q = clamp(q, vec2(0.5), size - 0.5);
#endif
        float z = sample_depth_at(q);
#ifdef FLOOR
        accessibility += z;
#else
        // S.z > P.z + offset, as rises above P: no sum in which most of the offset's digits are lost.
        float rise_z = z - s.z;
        bool open = rise_z > offset.z || z >= background;
        // Depth range check: 0.5 where the surface is too far in front of P.
        accessibility += mix(float(open), 0.5, clamp(-rise_z / z, 0.0, 1.0));
#endif
    }
    float A = accessibility / float(N_SAMPLES);
#ifdef CURVE
    A = A * A + A;
#endif
    out_0 = clamp(A, 0.0, 1.0);
}
