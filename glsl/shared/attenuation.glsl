// Compiled in: one of ATTENUATION_*.

// W(r), of r^2.
float attenuation(float squared)
{
#if defined(ATTENUATION_QUADRATIC)
    return 1.0 - squared / (radius * radius);
#elif defined(ATTENUATION_LINEAR)
    return 1.0 - sqrt(squared) / radius;
#else
    return 1.0;
#endif
}
