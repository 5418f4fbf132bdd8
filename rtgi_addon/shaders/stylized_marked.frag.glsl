// How far a pixel is inside a marked line that is seen there; the deepest wins by the depth test (effects/stylized/marked.py).
#include "include/stylized.glsl"
#include "include/stylized_left.glsl"

void main()
{
  vec2 along = line_ends.zw - line_ends.xy;
  float share = clamp(dot(gl_FragCoord.xy - line_ends.xy, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
  vec2 nearest = line_ends.xy + along * share;
  float depth = frame.orthographic != 0 ? mix(line_look.x, line_look.y, share) :
                                          1.0 / mix(1.0 / line_look.x, 1.0 / line_look.y, share);
  ivec2 middle = clamp(ivec2(floor(nearest)), ivec2(0), frame.size - 1);
  float behind = -1e30;
  float left = 0.0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      ivec2 beside = clamp(middle + ivec2(dx, dy), ivec2(0), frame.size - 1);
      behind = max(behind, effect_depth(beside));
      left = max(left, dot(left_at(beside), vec3(1.0 / 3.0)));
    }
  }
  float inside = line_look.z * left - length(gl_FragCoord.xy - nearest);
  if (inside <= -0.5 || depth > behind * (1.0 + MARKED_TOLERANCE)) {
    discard;
  }
  color = vec4(inside, line_look.w, 1.0, 0.0);
  gl_FragDepth = 0.5 - inside / 64.0;
}
