// Copies depth and normals as the passes read them, so that AmbientOcclusion::diagnose can read them back from textures
// of any kind.
out float out_0; // depth
out vec4 out_1;  // the normal as it is stored

void main()
{
    out_0 = depth_at(gl_FragCoord.xy);
    out_1 = vec4(stored_normal(gl_FragCoord.xy), 0.0);
}
