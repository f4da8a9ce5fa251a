// Eye space: x right, y up, z forward. A pixel's surface point is z (x', y', 1), or (x', y', z) when orthographic.
uniform vec2 size;  // of the window, in texels
uniform vec2 pixel; // what a texel adds to x' and y': 2 tan(fov/2) / size, orthographic 2 half_width / size

// x', y' of the window position p.
vec2 slope(vec2 p) { return (p - 0.5 * size) * pixel; }
