// Colour, linear depth and normal of the surface on the ray of the pixel's centre. Its float64 twin, by ray casting,
// is src/reference/gbuffer.rs.
//
// Compiled in: ORTHOGRAPHIC, NORMALS_BIASED, and one of NORMALS_DERIVATIVE, NORMALS_VERTEX.
in vec3 position; // in eye space, from the middle of the near plane: x, y, z - near
#ifdef NORMALS_VERTEX
in vec3 smooth_normal;
#endif

uniform vec3 diffuse;    // the material's colour
uniform vec3 light;      // unit, towards the light, eye space
uniform vec2 shading;    // how much of the colour is ambient, and how much follows the light
uniform vec2 near_far;

out vec4 out_0; // colour; alpha is the share of it that is ambient
out float out_1; // linear depth
out vec4 out_2; // normal

// v with a largest component of 1 in magnitude; zero where it is zero, infinite or no number.
vec3 scaled(vec3 v)
{
    float largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    return largest > 0.0 && largest <= 3.4e38 ? v / largest : vec3(0.0);
}

// The unit vector along v, where it has a direction.
vec3 unit(vec3 v, vec3 otherwise)
{
    v = scaled(v);
    return v != vec3(0.0) ? normalize(v) : otherwise;
}

void main()
{
    // The triangle's plane, by derivatives within it, turned towards the eye.
#ifdef ORTHOGRAPHIC
    vec3 r = vec3(0.0, 0.0, 1.0);
    vec2 off_ray = position.xy - slope(gl_FragCoord.xy);
#else
    vec3 r = vec3(slope(gl_FragCoord.xy), 1.0);
    vec2 off_ray = position.xy - (near_far.x + position.z) * r.xy;
#endif
    // The cross product of what is scaled first over- and underflows at no size, nor beside a horizon, where a
    // neighbour in this plane may lie millions of times as far away.
    vec3 plane = unit(cross(scaled(dFdx(position)), scaled(dFdy(position))), -normalize(r));
    float facing = dot(plane, r);
    if (facing > 0.0) {
        plane = -plane;
        facing = -facing;
    }

    // z = (n.Q) / (n.r), as the interpolated z and what moves it from Q onto the ray.
    float z = near_far.x + (facing < 0.0 ? position.z + dot(plane.xy, off_ray) / facing : position.z);
    // What is no number, far beyond the triangle on a plane that meets the ray nowhere, is near too.
    z = z > near_far.x ? min(z, near_far.y) : near_far.x;

#ifdef NORMALS_VERTEX
    vec3 n = unit(smooth_normal, plane);
    // To the side of the triangle that is seen; near a silhouette it may still lean away from the eye.
    n = dot(n, plane) < 0.0 ? -n : n;
#else
    vec3 n = plane;
#endif

    float lit = shading.y * max(dot(n, light), 0.0);
    out_0 = vec4(diffuse * (shading.x + lit), shading.x / (shading.x + lit));
    out_1 = z;
#ifdef NORMALS_BIASED
    out_2 = vec4(0.5 * n + 0.5, 1.0);
#else
    out_2 = vec4(n, 0.0);
#endif
}
