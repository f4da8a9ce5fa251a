// Linear depth from a hardware depth buffer of any convention, or from the first sample of a multisample texture. The
// float64 twin is src/reference/linear_depth.rs.
out float out_0;

void main()
{
    out_0 = linear_depth(depth_of_pixel(gl_FragCoord.xy));
}
