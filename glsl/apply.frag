// Writes visibility A to an image of the caller. Blending may multiply what is there by it; then only the ambient share
// s of the colour is darkened: the factor is 1 - s (1 - A).
//
// Compiled in: one of SHARE_IMAGE, SHARE_RECTANGLE, SHARE_LAYER and SHARE_MULTISAMPLE, if s is in the alpha channel of
// a texture; otherwise s is one number.
uniform sampler2DRect ao_image;
uniform vec2 corner;     // the window position of the view's lower left corner
uniform float ao_texels; // texels of ao_image per pixel, along a row: 1, or 1/2 if ao_image has half the size

uniform vec2 share_corner; // the lower left texel of the view in the texture of s
#if defined(SHARE_IMAGE)
uniform sampler2D share_image;
float share(vec2 p) { return texelFetch(share_image, ivec2(p + share_corner), 0).a; }
#elif defined(SHARE_RECTANGLE)
uniform sampler2DRect share_image;
float share(vec2 p) { return texelFetch(share_image, ivec2(p + share_corner)).a; }
#elif defined(SHARE_LAYER)
uniform sampler2DArray share_image;
uniform int share_layer;
float share(vec2 p) { return texelFetch(share_image, ivec3(p + share_corner, share_layer), 0).a; }
#elif defined(SHARE_MULTISAMPLE)
uniform sampler2DMS share_image;
float share(vec2 p) { return texelFetch(share_image, ivec2(p + share_corner), 0).a; }
#else
uniform float ambient_share;
float share(vec2 p) { return ambient_share; }
#endif

out vec4 out_0;

void main()
{
    vec2 p = gl_FragCoord.xy - corner;
    float A = texture(ao_image, ao_texels * p).r;
    out_0 = vec4(vec3(1.0 - share(p) * (1.0 - A)), 1.0);
}
