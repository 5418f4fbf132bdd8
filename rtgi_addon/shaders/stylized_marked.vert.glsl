// A marked edge as a strip of the picture, wide enough for its line.

void main()
{
  line_ends = ends;
  line_look = look;
  gl_Position = vec4(corner / vec2(frame.size) * 2.0 - 1.0, 0.0, 1.0);
}
