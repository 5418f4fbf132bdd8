// The edges of volumes; faint where surfaces stand in front.
#include "include/overlay.glsl"

void main()
{
  float alpha = overlay_hidden(position_world) ? 0.25 : 1.0;
  color = vec4(overlay.line_color * alpha, alpha);
}
