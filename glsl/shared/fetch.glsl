// Texels by window coordinates: centres lie at whole numbers + 0.5, y up. Textures that the pipeline makes are
// rectangles; the caller's depth and normals may be two-dimensional instead.
//
// Compiled in: DEPTH_RECTANGLE; SCALE, where a texel of the target stands for more than a pixel of the full image: how
// many in x and y.
uniform vec2 texel; // 1 / size of the full image, for two-dimensional textures

#ifdef DEPTH_RECTANGLE
uniform sampler2DRect depth_image;
float depth_of_pixel(vec2 p) { return texture(depth_image, p).r; }
#else
uniform sampler2D depth_image;
float depth_of_pixel(vec2 p) { return textureLod(depth_image, p * texel, 0.0).r; }
#endif

// The full image's pixel that a texel of the target stands for: at half resolution (2i, 2j) for (i, j).
#ifdef SCALE
vec2 pixel_of(vec2 p) { return SCALE * (p - 0.5) + 0.5; }
#else
vec2 pixel_of(vec2 p) { return p; }
#endif

float depth_at(vec2 p) { return depth_of_pixel(pixel_of(p)); }

// Depths from here on are background.
uniform float background;
