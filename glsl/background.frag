// Marks the pixels that hold a surface in the stencil, so that later passes do not even start on background.
void main()
{
    if (depth_at(gl_FragCoord.xy) >= background)
        discard;
}
