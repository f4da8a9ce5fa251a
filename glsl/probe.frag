// Writes what three formats must be able to hold (src/pass/probe.rs).
//
// Compiled in: VALUE_0, VALUE_1, VALUE_2.
out vec4 out_0;
out vec4 out_1;
out vec4 out_2;

void main()
{
    out_0 = VALUE_0;
    out_1 = VALUE_1;
    out_2 = VALUE_2;
}
