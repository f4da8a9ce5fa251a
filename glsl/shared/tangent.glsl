// The tangent plane of the surface, for the methods that measure horizons from it.
//
// Compiled in: BIAS, if the angle bias is above 0.
uniform vec2 bias; // cosine and sine of the angle bias

// Returns the sine of an elevation that is raised by the angle bias, to at most 90 degrees.
float raised(float sine, float cosine)
{
#ifdef BIAS
    return sine > bias.x ? 1.0 : sine * bias.x + cosine * bias.y;
#else
    return sine;
#endif
}

// Returns the sine of the elevation of the tangent T = du dP/dx' + dv dP/dy' (Eq. 6.2.11), with lateral = (du, dv). The
// elevation is raised by the angle bias, to at most 90 degrees.
//
// dP/dx' = z (e_x - r n.x / (n.r)). T is multiplied by -(n.r) / z: this factor is positive, so the direction stays the
// same. No division by n.r remains; n.r is 0 if the surface is seen edge-on.
float sine_of_tangent(Surface s, vec2 lateral)
{
    float rise = dot(s.n.xy, lateral);
    vec3 T = vec3(s.facing * lateral + rise * s.r, rise);
    float inverse = inversesqrt(max(dot(T, T), 1e-36));
    return raised(-T.z * inverse, dot(T, T) > 0.0 ? length(T.xy) * inverse : 1.0);
}
