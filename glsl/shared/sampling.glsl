// The samples about a pixel: ShaderX7 6.2, Directions and jittering, Variable step size, Snapping.
//
// Compiled in: N_D, N_S, DIRECTIONS (the N_D unit vectors at angles 2 pi k / N_D), EACH_STEP(step), which is step(1)
// step(2) and so on to step(N_S), and one each of SNAP_*, CLAMP_*.
const vec2 directions[N_D] = vec2[N_D](DIRECTIONS);

// The step between two samples, in texels. Where it is below 1 on either axis, A is 1: the chapter's early exit.
vec2 step_in_texels(Surface s) { return radius_in_texels(s.z) / float(N_S + 1); }

struct Direction {
    vec2 first;  // what jitter moves every sample by
    vec2 stride; // from a sample to the next
};

// Eq. 6.2.10: direction k, turned by a.
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

// Its direction alone: the stride's length may be past what can be squared.
vec2 along(Direction d) { return d.stride / max(abs(d.stride.x), abs(d.stride.y)); }

struct Sample {
    vec3 D;        // S - P
    float squared; // |D|^2
    float z;       // of the texel read
    vec2 taken;    // the texel read less P's own; a sample on P's own texel is ignored
};

// Sample i = 1..N_S of a direction.
Sample sample_at(Surface s, Direction d, int i)
{
    Sample result;
    vec2 exact = d.first + float(i) * d.stride;
#ifdef SNAP_STEP
    vec2 offset = exact; // whole texels already
#else
    vec2 offset = floor(exact + 0.5);
#endif
    vec2 q = clamp(s.p + offset, vec2(0.5), size - 0.5);
    result.z = depth_at(q);
    result.taken = q - s.p;
    // Where the sample is taken to lie, in texels from p.
#if defined(SNAP_NONE) && defined(CLAMP_POSITION)
    vec2 at = result.taken == offset ? exact : result.taken;
#elif defined(SNAP_NONE)
    vec2 at = exact;
#elif defined(CLAMP_POSITION)
    vec2 at = result.taken;
#else
    vec2 at = offset;
#endif
    result.D = from_surface(s, at, result.z);
    result.squared = dot(result.D, result.D);
    return result;
}

// A surface within R, and not P's own texel: background may lie within R too, where R is larger than all depths.
bool within(Sample S) { return S.squared <= radius * radius && S.z < background && S.taken != vec2(0.0); }
