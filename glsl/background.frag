// Discards background. The stencil is written where this shader does not discard, that is, at pixels that hold a
// surface; later passes test the stencil, so their shaders never run on background.
void main()
{
    if (depth_at(gl_FragCoord.xy) >= background)
        discard;
}
