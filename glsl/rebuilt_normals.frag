// Normals from depth alone: the cross product of the ways to a neighbour in x and to one in y. Of the two neighbours
// along each axis, the one is taken whose depth differs less: at a silhouette the other lies on another surface. The
// float64 twin is src/reference/rebuilt_normals.rs.
//
// Compiled in, each if it applies: ORTHOGRAPHIC, for an orthographic projection.
out vec4 out_0;

#ifdef SCALE
#define FULL_PIXEL (pixel / SCALE)
#define FULL_SIZE (extent * SCALE)
#else
#define FULL_PIXEL pixel
#define FULL_SIZE extent
#endif

// Returns the depth at the pixel q of the full image, which is background if q lies outside.
float neighbour(vec2 q)
{
    return q == clamp(q, vec2(0.5), FULL_SIZE - 0.5) ? depth_of_pixel(q) : background;
}

// Returns the way along the surface by one pixel in the direction of `axis`, in perspective divided by z.
vec3 along(vec2 p, float z, vec2 r, vec2 axis)
{
    float after = neighbour(p + axis);
    float before = neighbour(p - axis);
    float side = abs(after - z) <= abs(before - z) ? 1.0 : -1.0;
    float q_z = side > 0.0 ? after : before;
    // With no surface on either side, the depth is assumed not to change along this axis.
    q_z = q_z < background ? q_z : z;
    float dz = q_z - z;
#ifdef ORTHOGRAPHIC
    return vec3(axis * FULL_PIXEL, side * dz);
#else
    // Q.z (r + axis pixel) - P.z r, without the difference of two positions.
    return vec3(side * dz * r + q_z * (axis * FULL_PIXEL), side * dz) / z;
#endif
}

void main()
{
    vec2 p = pixel_of(gl_FragCoord.xy);
    float z = depth_of_pixel(p);
#ifdef ORTHOGRAPHIC
    vec2 r = vec2(0.0);
#else
    vec2 r = slope(gl_FragCoord.xy);
#endif
    vec3 x = along(p, z, r, vec2(1.0, 0.0));
    vec3 y = along(p, z, r, vec2(0.0, 1.0));
    // Both are scaled, so that the product neither overflows nor underflows.
    x /= max(max(abs(x.x), abs(x.y)), abs(x.z));
    y /= max(max(abs(y.x), abs(y.y)), abs(y.z));
    vec3 n = cross(x, y);
    n /= max(max(max(abs(n.x), abs(n.y)), abs(n.z)), 1e-30);
    out_0 = vec4(dot(n, vec3(r, 1.0)) > 0.0 ? -n : n, 0.0);
}
