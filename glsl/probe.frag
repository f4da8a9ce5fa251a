// Writes what every format of the G-buffer must be able to hold.
out vec4 out_0;
out vec4 out_1;
out vec4 out_2;

void main()
{
    out_0 = vec4(1.0, 0.0, 1.0, 0.0);
    out_1 = vec4(BACKGROUND);
    out_2 = vec4(NORMAL, 0.0);
}
