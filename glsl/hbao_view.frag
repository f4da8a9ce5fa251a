// Horizon-based ambient occlusion about the view ray: ShaderX7 6.2, Eq. 6.2.9, with v, the direction from P to the eye,
// in place of the Z axis. In perspective a line in the image is one azimuth about v, and not about the Z axis.
// The float64 twin is src/reference/hbao_view.rs.
//
// Compiled in, in addition to what the shared pieces list: BIAS, if the angle bias is above 0; one of ATTENUATION_*;
// one of ZENITH_*; one of QUADRATURE_*; SPACED(x), the power of x by which samples are spaced, if it is not x itself;
// and FLOOR, as in hbao.frag.
out float out_0;

// What the samples i = 1..N_S of a pixel have in common in all directions, at the index i - 1.
float walk[N_S]; // the way from P to the sample, in steps
float mean[N_S]; // the factor of |D|^2 for which W is the mean of W at the sample and as far away as the one before
float wide[N_S]; // 1 - q^2: how wide the interval from the sample before to the sample is

// Computes them for sample i. The sample lies at f_i = ((b + i)/(N + 1))^spacing of R, but at least a texel from P on
// either axis. Samples that are evenly spaced are never nearer.
void measure(Surface s, Steps steps, int i)
{
    float even = s.jitter.z + float(i);
#ifdef SPACED
    float all = steps.count + 1.0;
    walk[i - 1] = max(all * SPACED(even / all), 1.0 / min(steps.px.x, steps.px.y));
    float nearer = SPACED((even - 1.0) / even);
#else
    walk[i - 1] = even;
    float nearer = (even - 1.0) / even;
#endif
    // q = f_(i-1)/f_i, with f_0 = 0.
    float q = i > 1 ? nearer : 0.0;
    mean[i - 1] = mean_of_squares(q);
    wide[i - 1] = 1.0 - q * q;
}
#define MEASURE(i) measure(s, steps, i);

// The plane that is spanned by v and a, the unit azimuth of a direction of the image.
struct Slice {
    float sine;   // sine of t(theta), the elevation over a of the surface's tangent in this plane
    float cosine; // cosine of t(theta)
    float ray;    // |r|
    vec2 up;      // x and y of the vector up
    vec2 ahead;   // x and y of the vector ahead
    float least;  // the least share of an offset that D.ahead must be
};

// A sample nearly at a right angle to its slice, as the picture's border can make it, has no elevation in the slice:
// what is left of D there is little more than a rounding error. This is the least share, relative to that of a sample
// in the slice.
const float BESIDE = 1.0 / 16.0;

// Returns the slice in the direction e of the image, a unit vector in eye space.
//
// With m = sqrt((n.v)^2 + (n.a)^2): sin t = -(n.a)/m, cos t = (n.v)/m, n' = n/m and T = ((n.v) a - (n.a) v)/m. Then X =
// D.n' is how high S lies above the surface, C = D.T how far along it, and turned by t these are D.up and D.ahead, with
// up = cos t n' + sin t T and ahead = cos t T - sin t n'. For a D in the slice they are D.v and D.a. For a sample that
// snapping has moved beside the slice, they are those of the point that it gets to when it is moved back into the slice
// parallel to the tangent plane. So the elevation of a sample on the tangent plane is t, whatever its azimuth.
Slice slice_at(Surface s, vec2 e)
{
    Slice result;
    vec3 r = vec3(s.r, 1.0);
    result.ray = length(r);
    float inverse = inversesqrt(max(dot(s.n, s.n), 1e-36));
    vec3 n = s.n * inverse;
    // n.v can be 0 if the surface is seen edge-on. Such a normal is turned a little towards the eye.
    float nv = max(s.facing * inverse / result.ray, 1e-6);
    // b is the slice's unit normal, and a = b x r / |r|.
    vec3 b = vec3(-e.y, e.x, r.x * e.y - r.y * e.x);
    b *= inversesqrt(dot(b, b));
    vec3 a = cross(b, r) / result.ray;
    float na = dot(n, a);
    float squared = nv * nv + na * na;
    result.sine = -na * inversesqrt(squared);
    result.cosine = nv * inversesqrt(squared);
    vec2 back = dot(n, b) / squared * b.xy;
    result.up = nv * back - r.xy / result.ray;
    result.ahead = na * back + a.xy;
    result.least = BESIDE * max(abs(result.ahead.x), abs(result.ahead.y));
    return result;
}

// The horizon of one direction, after the samples taken so far.
struct Horizon {
    float sine;      // sine of the horizon's elevation
    float tangent;   // sine of the tangent that elevations are measured from
    float previous;  // the last accepted sample's sine minus the tangent's
    float weight;    // W of the last accepted sample; 1 before the first
    float occlusion; // the sum of Eq. 6.2.9 so far
};

// Updates the horizon and the occlusion by sample i = 1..N_S.
void look_at(inout Horizon h, Surface s, Direction d, Slice slice, int i)
{
#ifdef SNAP_STEP
    Place place = place_at(s, d.first + float(i) * d.stride);
#else
    Place place = place_at(s, walk[i - 1] * d.stride);
#endif
    float z = depth_at(s.p + place.taken);
#ifdef FLOOR
    h.occlusion += z;
#else
    // D = S - P, by its sine of elevation and its length.
#ifdef ZENITH_VIEW
    // D is (z - P.z) r plus the offset, in perspective at the depth z; r.up = -|r| and r.ahead = 0.
    vec2 offset = place.at * pixel;
    float ahead = dot(slice.ahead, offset);
    // What snapping has moved behind P in the slice belongs to the opposite direction.
    bool seen = ahead > slice.least * max(abs(offset.x), abs(offset.y));
#ifdef ORTHOGRAPHIC
    float up = dot(slice.up, offset) - (z - s.z);
#else
    float up = z * dot(slice.up, offset) - slice.ray * (z - s.z);
    ahead *= z;
#endif
    float squared = up * up + ahead * ahead;
#else
    vec3 D = from_surface(s, place.at, z);
    float up = -D.z;
    float squared = dot(D, D);
    h.tangent = sine_of_tangent(s, place.taken * pixel);
    bool seen = true;
#endif
    float sine = up * inversesqrt(squared);
    bool within = squared <= s.R * s.R && z < background && place.taken != vec2(0.0);
    bool accepted = seen && within && sine > h.sine;
    float rise = sine - h.tangent;
#if defined(QUADRATURE_EXPECTED)
    float weight = attenuation(mean[i - 1] * squared, s.R) * (1.0 + 0.25 * wide[i - 1] * (0.75 - rise));
#elif defined(QUADRATURE_INTERVAL)
    float weight = attenuation(mean[i - 1] * squared, s.R);
#elif defined(QUADRATURE_MEAN)
    float end = attenuation(squared, s.R);
    float weight = 0.5 * (end + h.weight);
    h.weight = accepted ? end : h.weight;
#else
    float weight = attenuation(squared, s.R);
#endif
    h.occlusion += accepted ? weight * (rise - h.previous) : 0.0;
    h.previous = accepted ? rise : h.previous;
    h.sine = accepted ? sine : h.sine;
#endif
}
#define LOOK_AT(i) look_at(h, s, d, slice, i);

void main()
{
    Surface s = surface_at(gl_FragCoord.xy);
    Steps steps = steps_at(s);
    if (steps.exits) {
        out_0 = 1.0;
        return;
    }

    EACH_STEP(MEASURE)
    float occlusion = 0.0;
    for (int k = 0; k < direction_count; ++k) {
        Direction d = direction(k, steps.px, s.jitter);
        // A step on either axis has the same length in eye space, so that the unit vector is its direction there.
        Slice slice = slice_at(s, turned(directions[k], s.jitter));
#ifdef ZENITH_VIEW
        float tangent = raised(slice.sine, slice.cosine);
#else
        float tangent = sine_of_tangent(s, along(d) * pixel);
#endif
        Horizon h = Horizon(tangent, tangent, 0.0, 1.0, 0.0);
        EACH_STEP(LOOK_AT)
        occlusion += h.occlusion;
    }
    out_0 = clamp(1.0 - strength / float(N_D) * occlusion, 0.0, 1.0);
}
