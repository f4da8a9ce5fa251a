// Fetches of depth by window coordinates: y points up, and texel centres lie at whole numbers plus 0.5. The pipeline's
// own textures are rectangle textures. The depth and normals of a caller may be two-dimensional textures instead.
//
// Compiled in: DEPTH_RECTANGLE, if depth is a rectangle texture; and SCALE, if a texel of the target stands for more
// than one pixel of the full image: a vec2 with the number of pixels in x and y.
uniform vec2 texel; // 1 / size of the full image; used for two-dimensional textures only

#ifdef DEPTH_RECTANGLE
uniform sampler2DRect depth_image;
float depth_of_pixel(vec2 p) { return texture(depth_image, p).r; }
#else
uniform sampler2D depth_image;
float depth_of_pixel(vec2 p) { return textureLod(depth_image, p * texel, 0.0).r; }
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
