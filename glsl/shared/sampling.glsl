// Computes the positions of the samples around a pixel: ShaderX7 6.2, Directions and jittering, Variable step size,
// Snapping.
//
// Compiled in: N_D, the number of directions; DIRECTIONS, their unit vectors, at the angles 2 pi k / N_D; N_S, the
// largest number of samples in a direction; EACH_STEP(step), which expands to step(1) step(2) ... as far as
// steps.count, where `steps` is a variable of the type Steps; DIRECTIONS_LOOPED, if the directions are too many to
// unroll their loop; one of EXIT_*; one of SNAP_*; and one of CLAMP_*.
const vec2 directions[N_D] = vec2[N_D](DIRECTIONS);

// The end of the loop over directions, which is N_D. A compiler cannot unroll the loop if the end is a uniform.
#ifdef DIRECTIONS_LOOPED
uniform int direction_count;
#else
const int direction_count = N_D;
#endif

// The steps that a pixel takes in each direction.
struct Steps {
    vec2 px;     // the step between two samples, in texels
    float count; // the number of samples, a whole number
    bool exits;  // whether the method exits early: A = 1, and no samples are taken
};

// A step counts as a texel if it is shorter by less than a millionth. Where R covers a whole number of texels in all of
// the picture, the method would otherwise exit, or not, by the rounding of float32.
const float TEXEL = 1.0 - 1e-6;

Steps steps_at(Surface s)
{
    vec2 radius_px = radius_in_texels(s);
#ifdef EXIT_SHORTEN
    // So many steps that none is shorter than a texel on either axis.
    float least = min(radius_px.x, radius_px.y);
    float count = clamp(floor(least) - 1.0, 1.0, float(N_S));
    return Steps(radius_px / (count + 1.0), count, least < 2.0 * TEXEL);
#else
    // The chapter's early exit: the step is shorter than a texel on either axis.
    vec2 px = radius_px / float(N_S + 1);
    return Steps(px, float(N_S), min(px.x, px.y) < TEXEL);
#endif
}

struct Direction {
    vec2 first;  // the jitter's offset, added to every sample; in texels
    vec2 stride; // the way from one sample to the next, in texels
};

// Returns direction k, turned by the tile's angle a (Eq. 6.2.10).
Direction direction(int k, vec2 step_px, vec3 jitter)
{
    Direction result;
    result.stride = step_px * turned(directions[k], jitter);
    result.first = jitter.z * result.stride;
#ifdef SNAP_STEP
    result.first = floor(result.first + 0.5);
    result.stride = floor(result.stride + 0.5);
#endif
    return result;
}

// Returns the direction of the stride, scaled so that its largest component is 1. The stride itself can be too long to
// be squared.
vec2 along(Direction d) { return d.stride / max(abs(d.stride.x), abs(d.stride.y)); }

// Where a sample lies in the image, in texels from P.
struct Place {
    vec2 taken; // the way to the texel that is read; zero if that is P's own, which is ignored
    vec2 at;    // where S is assumed to lie
};

// Returns the place of the sample that is meant to lie at the offset `exact` from P, in texels.
Place place_at(Surface s, vec2 exact)
{
    Place result;
#ifdef SNAP_STEP
    vec2 offset = exact; // whole texels already
#else
    vec2 offset = floor(exact + 0.5);
#endif
    result.taken = clamp(s.p + offset, vec2(0.5), size - 0.5) - s.p;
#if defined(SNAP_NONE) && defined(CLAMP_POSITION)
    result.at = result.taken == offset ? exact : result.taken;
#elif defined(SNAP_NONE)
    result.at = exact;
#elif defined(CLAMP_POSITION)
    result.at = result.taken;
#else
    result.at = offset;
#endif
    return result;
}

struct Sample {
    vec3 D;        // S - P
    float squared; // |D|^2
    float z;       // depth of the texel that was read
    vec2 taken;    // the way from P's texel to the texel that was read; zero if that is P's own, which is ignored
};

// Returns sample i = 1..N_S of direction d.
Sample sample_at(Surface s, Direction d, int i)
{
    Sample result;
    Place place = place_at(s, d.first + float(i) * d.stride);
    result.taken = place.taken;
    result.z = depth_at(s.p + place.taken);
    result.D = from_surface(s, place.at, result.z);
    result.squared = dot(result.D, result.D);
    return result;
}

// Returns whether a sample counts: it lies within R of P, on a surface, and not on P's own texel. Background must be
// tested for, because an R larger than all depths would include it.
bool within(Sample S, Surface s) { return S.squared <= s.R * s.R && S.z < background && S.taken != vec2(0.0); }
