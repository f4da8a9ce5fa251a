// The image: colour times visibility, over all of it or over its ambient share.
uniform sampler2DRect colour_image;
uniform sampler2DRect ao_image;

out vec4 out_0;

void main()
{
    vec4 colour = texture(colour_image, gl_FragCoord.xy);
    float A = texture(ao_image, gl_FragCoord.xy).r;
#ifdef APPLY_AMBIENT
    A = 1.0 - colour.a * (1.0 - A);
#endif
    out_0 = vec4(colour.rgb * A, 1.0);
}
