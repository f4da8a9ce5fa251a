// The image: colour times visibility, over all of it or over its ambient share.
//
// Compiled in: APPLY_AMBIENT.
uniform sampler2DRect colour_image;
uniform sampler2DRect ao_image;
uniform float ao_texels; // of ao_image to a pixel, in a row: 1, or 1/2 where nothing brought it to full size

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
