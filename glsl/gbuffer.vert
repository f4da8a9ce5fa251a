// The G-buffer's vertex shader. Positions are transformed to eye space in float64 before they are uploaded.
//
// Compiled in: NORMALS_VERTEX, if the fragment shader reads vertex normals.
in vec3 vertex_position; // in eye space, relative to a point of the near plane: see `origin` in gbuffer.rs
#ifdef NORMALS_VERTEX
in vec3 vertex_normal;
out vec3 smooth_normal;
#endif

uniform mat4 projection;

out vec3 position;

void main()
{
    position = vertex_position;
#ifdef NORMALS_VERTEX
    smooth_normal = vertex_normal;
#endif
    gl_Position = projection * vec4(vertex_position, 1.0);
}
