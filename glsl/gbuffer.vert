// The G-buffer's vertex shader. Positions are transformed to eye space in float64 before they are uploaded.
//
// Compiled in: NORMALS_VERTEX, if the fragment shader reads vertex normals; TEXTURED or CUT, if it reads textures;
// VERTEX_COLOURS, if it reads the colours of vertices.
in vec3 vertex_position; // in eye space, relative to a point of the near plane: see `origin` in gbuffer.rs
#ifdef NORMALS_VERTEX
in vec3 vertex_normal;
out vec3 smooth_normal;
#endif
#if defined(TEXTURED) || defined(CUT)
in vec2 vertex_coordinates;
out vec2 coordinates;
#endif
#ifdef VERTEX_COLOURS
in vec3 vertex_colour;
out vec3 tint;
#endif

uniform mat4 projection;

out vec3 position;

void main()
{
    position = vertex_position;
#ifdef NORMALS_VERTEX
    smooth_normal = vertex_normal;
#endif
#if defined(TEXTURED) || defined(CUT)
    coordinates = vertex_coordinates;
#endif
#ifdef VERTEX_COLOURS
    tint = vertex_colour;
#endif
    gl_Position = projection * vec4(vertex_position, 1.0);
}
