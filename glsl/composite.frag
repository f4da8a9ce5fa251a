// The final image: colour times visibility A.
//
// Compiled in: APPLY_AMBIENT, if A is to multiply only the ambient share of the colour, which is in the colour's alpha.
uniform sampler2DRect colour_image;
uniform sampler2DRect ao_image;
uniform float ao_texels; // texels of ao_image per pixel, along a row: 1, or 1/2 if ao_image has half the size

out vec4 out_0;

void main()
{
    vec4 colour = texture(colour_image, gl_FragCoord.xy);
    float A = texture(ao_image, ao_texels * gl_FragCoord.xy).r;
#ifdef APPLY_AMBIENT
    A = 1.0 - colour.a * (1.0 - A);
#endif
    out_0 = vec4(colour.rgb * A, 1.0);
}
