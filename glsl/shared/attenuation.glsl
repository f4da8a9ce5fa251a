// The attenuation W of ShaderX7 6.2: how much a sample at the distance r from P occludes.
//
// Compiled in: one of ATTENUATION_QUADRATIC, ATTENUATION_LINEAR and ATTENUATION_NONE.

// W(r) = 1 - r^2/R^2, 1 - r/R or 1. The first argument is r^2.
float attenuation(float squared, float R)
{
#if defined(ATTENUATION_QUADRATIC)
    return 1.0 - squared / (R * R);
#elif defined(ATTENUATION_LINEAR)
    return 1.0 - sqrt(squared) / R;
#else
    return 1.0;
#endif
}

// Returns the factor of r^2 for which W is the mean of W(q r) and W(r).
float mean_of_squares(float q)
{
#if defined(ATTENUATION_QUADRATIC)
    return 0.5 * (1.0 + q * q);
#else
    return 0.25 * (1.0 + q) * (1.0 + q);
#endif
}
