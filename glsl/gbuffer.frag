// Colour, linear depth and normal of the surface on the ray of the pixel's centre. Its float64 twin, by ray casting,
// is src/reference/gbuffer.rs.
//
// Compiled in: ORTHOGRAPHIC, NORMALS_BIASED, and one of NORMALS_DERIVATIVE, NORMALS_VERTEX.
in vec3 position;
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

void main()
{
    // The triangle's plane, by derivatives within it, turned towards the eye.
#ifdef ORTHOGRAPHIC
    vec3 r = vec3(0.0, 0.0, 1.0);
    float footprint = pixel.y;
    vec2 off_ray = position.xy - slope(gl_FragCoord.xy);
#else
    vec3 r = vec3(slope(gl_FragCoord.xy), 1.0);
    float footprint = position.z * pixel.y;
    vec2 off_ray = position.xy - position.z * r.xy;
#endif
    // In units of a pixel's width there, so that no scale over- or underflows.
    vec3 plane = cross(dFdx(position) / footprint, dFdy(position) / footprint);
    float squared = dot(plane, plane);
    plane = squared > 0.0 ? plane * inversesqrt(squared) : -normalize(r);
    float facing = dot(plane, r);
    if (facing > 0.0) {
        plane = -plane;
        facing = -facing;
    }

    // z = (n.Q) / (n.r), as the interpolated z and what moves it from Q onto the ray.
    float z = facing < 0.0 ? position.z + dot(plane.xy, off_ray) / facing : position.z;
    z = clamp(z, near_far.x, near_far.y);

#ifdef NORMALS_VERTEX
    float length_squared = dot(smooth_normal, smooth_normal);
    vec3 n = length_squared > 0.0 ? smooth_normal * inversesqrt(length_squared) : plane;
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
