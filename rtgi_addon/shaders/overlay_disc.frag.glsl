// A flat disc on a surface, thinner towards its edge.
#include "include/overlay.glsl"

void main()
{
  float distance = dot(across, across);
  if (distance > 1.0 || overlay_hidden(position_world)) {
    discard;
  }
  float alpha = tint.a * (1.0 - 0.5 * distance * distance);
  color = vec4(tint.rgb * alpha, alpha);
}
