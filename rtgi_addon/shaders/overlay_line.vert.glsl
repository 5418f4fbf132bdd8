void main()
{
  position_world = corner;
  gl_Position = overlay.clip_from_world * vec4(corner, 1.0);
}
