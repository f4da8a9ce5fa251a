// Fetches of depth by window coordinates: y points up, and texel centres lie at whole numbers plus 0.5. The pipeline's
// own textures are rectangle textures. The depth and normals of a caller may be in textures of other kinds, and may be
// a part of larger ones.
//
// Compiled in: one of DEPTH_RECTANGLE, DEPTH_LAYER and DEPTH_MULTISAMPLE, if depth is a rectangle texture, a layer of
// an array, or the first sample of a multisample texture; DEPTH_VIEWPORT, if depth is a part of the texture; and SCALE,
// if a texel of the target stands for more than one pixel of the full image: a vec2 with the number of pixels in x and
// y.
uniform vec2 texel;    // 1 / size of the texture of depth; used for two-dimensional textures and layers only
uniform vec4 viewport; // the part of the caller's textures that is read: its lower left corner and its size, in texels

// Returns the place of a pixel in a texture of which the viewport is a part. Pixels outside are clamped to its border.
vec2 in_viewport(vec2 p) { return viewport.xy + clamp(p, vec2(0.5), viewport.zw - 0.5); }

#ifdef DEPTH_VIEWPORT
#define DEPTH_PLACE(p) in_viewport(p)
#else
#define DEPTH_PLACE(p) (p)
#endif

#if defined(DEPTH_RECTANGLE)
uniform sampler2DRect depth_image;
float depth_of_pixel(vec2 p) { return texture(depth_image, DEPTH_PLACE(p)).r; }
#elif defined(DEPTH_LAYER)
uniform sampler2DArray depth_image;
uniform float depth_layer;
float depth_of_pixel(vec2 p) { return textureLod(depth_image, vec3(DEPTH_PLACE(p) * texel, depth_layer), 0.0).r; }
#elif defined(DEPTH_MULTISAMPLE)
uniform sampler2DMS depth_image;
float depth_of_pixel(vec2 p) { return texelFetch(depth_image, ivec2(DEPTH_PLACE(p)), 0).r; }
#else
uniform sampler2D depth_image;
float depth_of_pixel(vec2 p) { return textureLod(depth_image, DEPTH_PLACE(p) * texel, 0.0).r; }
#endif

// The centre of the pixel in the full image that a texel of the target stands for. At half resolution texel (i, j)
// stands for pixel (2i, 2j).
#ifdef SCALE
vec2 pixel_of(vec2 p) { return SCALE * (p - 0.5) + 0.5; }
#else
vec2 pixel_of(vec2 p) { return p; }
#endif

// The depth at the texel p of the target.
float depth_at(vec2 p) { return depth_of_pixel(pixel_of(p)); }

// This depth and all greater ones are background.
uniform float background;
