// The rays through texels, in eye space: x points right, y up, z forward. The surface point at depth z on the ray with
// the slope (x', y') is z (x', y', 1), or (x', y', z) from the middle of the picture when orthographic.
uniform vec2 size;   // size of the target, in texels
uniform vec2 extent; // size of the whole picture in texels of the target; at half resolution it may be `size` minus 1/2
uniform vec2 axis;   // the point of the target where x' = y' = 0. It is on the view's axis, which in a centred view goes
                     // through the middle of the full image; when orthographic it is always that middle. At half
                     // resolution, texel centres and pixel centres differ, which adds a quarter texel
uniform vec2 pixel;  // what one texel adds to x' and y': 2 tan(fov/2) / extent, or 2 half_width / extent, if centred

// The slope (x', y') of the ray through the window position p.
vec2 slope(vec2 p) { return (p - axis) * pixel; }
