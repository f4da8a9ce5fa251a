// Screen-space ambient occlusion as Crysis has it, ShaderX7 6.1: the share of points around P that lie in free space,
// in front of the surface that is seen at their texels. The float64 twin is src/reference/ssao.rs.
//
// Compiled in: N_SAMPLES, the number of points; LENGTHS, the lengths l_i of their offsets from P; one of ROTATION_*;
// HALF_DEPTH, NORMALS and CURVE, each if that setting is on; and FLOOR, as in hbao.frag.
out float out_0;

#ifdef HALF_DEPTH
uniform sampler2DRect half_depth_image;
// Pixel number x reads texel floor(x / 2) of the half-size image. 0.5 * (x + 0.5) lies 1/4 or 3/4 of a texel into that
// texel, so rounding cannot move it to a neighbour.
float sample_depth_at(vec2 q) { return texture(half_depth_image, 0.5 * pixel_of(q)).r; }
#else
float sample_depth_at(vec2 q) { return depth_at(q); }
#endif

const float lengths[N_SAMPLES] = float[N_SAMPLES](LENGTHS);

// Returns the matrix that turns an offset by v, a unit vector from the tile (6.1, Randomly rotated kernel).
mat3 turned_by(vec3 v)
{
#ifdef ROTATION_MIRROR
    // 6.1, Future improvements: the offset o is reflected in the plane with the normal v, o - 2 (o.v) v.
    return mat3(1.0) - 2.0 * outerProduct(v, v);
#else
    // The rotation that carries (0, 0, 1) to v. The tile has v.z >= 0 only, so the division is never by 0.
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

    // 6.1, SSAO pixel shader: the offsets point to the corners of a cube and have the lengths l_i. Sample i uses corner
    // i % 8; x changes its sign most slowly, z fastest. Opposite corners lie on one diagonal, so four diagonals, turned
    // once, serve all samples. An offset's x and y are texture coordinates, and its z is in units of 2 P.z; `scale`
    // converts them to texels and scene units.
    vec3 scale = vec3(extent, 2.0 * s.z) * inversesqrt(3.0);
    vec3 diagonals[4] = vec3[4](scale * (turn[0] + turn[1] + turn[2]), scale * (turn[0] + turn[1] - turn[2]),
                                scale * (turn[0] - turn[1] + turn[2]), scale * (turn[0] - turn[1] - turn[2]));

    float accessibility = 0.0;
    for (int i = 0; i < N_SAMPLES; ++i) {
        int corner = i % 8;
        vec3 diagonal = diagonals[min(corner, 7 - corner)];
        float along = corner < 4 ? -lengths[i] : lengths[i];
#ifdef NORMALS
        // 6.1, Future improvements: no sample lies behind the surface. Q is the point at the sample's depth on the ray
        // through the sample's position. If n.(Q - P) is negative, the offset is reversed. In perspective the product
        // is divided by P.z, which leaves its sign.
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
        // The sample reads the nearest texel. Beyond the border the sampler clamps the position to a pixel. This is
        // enough at full resolution only. If a texel stands for several pixels, the position must be clamped to a texel
        // first.
        vec2 q = s.p + floor(offset.xy + 0.5);
#ifdef SCALE
        q = clamp(q, vec2(0.5), size - 0.5);
#endif
        float z = sample_depth_at(q);
#ifdef FLOOR
        accessibility += z;
#else
        // The point lies in free space if S.z > P.z + offset.z. Both sides are taken relative to P.z, since most digits
        // of the offset would be lost in the sum.
        float rise_z = z - s.z;
        bool open = rise_z > offset.z || z >= background;
        // 6.1, depth range check: the sample counts 0.5 if the surface is too far in front of P.
        accessibility += mix(float(open), 0.5, clamp(-rise_z / z, 0.0, 1.0));
#endif
    }
    float A = accessibility / float(N_SAMPLES);
#ifdef CURVE
    A = A * A + A;
#endif
    out_0 = clamp(A, 0.0, 1.0);
}
