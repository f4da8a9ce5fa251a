// Texels by window coordinates: centres lie at whole numbers + 0.5, y up. Textures that the pipeline makes are
// rectangles; the caller's depth and normals may be two-dimensional instead.
uniform vec2 texel; // 1 / size, for two-dimensional textures

#ifdef DEPTH_RECTANGLE
uniform sampler2DRect depth_image;
float depth_at(vec2 p) { return texture(depth_image, p).r; }
#else
uniform sampler2D depth_image;
float depth_at(vec2 p) { return textureLod(depth_image, p * texel, 0.0).r; }
#endif

// Depths from here on are background.
uniform float background;
