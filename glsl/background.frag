// Discards background. The stencil is written at the pixels that this shader does not discard, which hold a surface.
// Later passes test the stencil, so their shaders never run on background.
void main()
{
    if (depth_at(gl_FragCoord.xy) >= background)
        discard;
}
