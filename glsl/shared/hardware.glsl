// Linear depth z from the value d that a depth buffer stores. t is 0 at the far end, where the depth buffer is cleared.
//
// Compiled in: one of CURVE_PERSPECTIVE, CURVE_ORTHOGRAPHIC and CURVE_LOGARITHMIC, or none if d is z itself; and
// CURVE_REVERSED, if d is 1 at the near plane and 0 at the far plane.
uniform vec2 curve; // perspective: 1/far and 1/near - 1/far; orthographic: near and far - near; logarithmic: ln(C far +
                    // 1) and 1/C

float linear_depth(float d)
{
#if defined(CURVE_PERSPECTIVE) || defined(CURVE_ORTHOGRAPHIC)
#ifdef CURVE_REVERSED
    float t = d;
    float from_near = 1.0 - d;
#else
    float t = 1.0 - d;
    float from_near = d;
#endif
#endif
#if defined(CURVE_PERSPECTIVE)
    // 1/z is linear in d. Both terms are at least 0, so that no digits are lost to a difference.
    float inverse = curve.x + curve.y * t;
    return t > 0.0 && inverse > 0.0 ? min(1.0 / inverse, background) : background;
#elif defined(CURVE_ORTHOGRAPHIC)
    return t > 0.0 ? curve.x + curve.y * from_near : background;
#elif defined(CURVE_LOGARITHMIC)
    // C z = exp(x) - 1. For small x the difference would lose digits, and a series is used.
    float x = d * curve.x;
    float grown = x < 0.1 ? x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0)))) : exp(x) - 1.0;
    return d < 1.0 ? grown * curve.y : background;
#else
    return d;
#endif
}
