// Writes a constant to each of three targets. src/pass/probe.rs reads them back, to see whether the driver renders to
// the formats of the targets.
//
// Compiled in: VALUE_0, VALUE_1 and VALUE_2, the constants, each a vec4.
out vec4 out_0;
out vec4 out_1;
out vec4 out_2;

void main()
{
    out_0 = VALUE_0;
    out_1 = VALUE_1;
    out_2 = VALUE_2;
}
