// Eye space: x right, y up, z forward. A pixel's surface point is z (x', y', 1), or (x', y', z) when orthographic.
uniform vec2 size;  // of the target, in texels
uniform vec2 extent; // of the full image, in the target's texels: size, or half a texel less at half resolution
uniform vec2 axis;  // where in the target the view's axis lies: its middle, at half resolution a quarter texel off
uniform vec2 pixel; // what a texel adds to x' and y': 2 tan(fov/2) / size, orthographic 2 half_width / size

// x', y' of the window position p.
vec2 slope(vec2 p) { return (p - axis) * pixel; }
