// A mirror ball about each sphere probe. A ball: (position, radius).
#include "include/list.glsl"

void main()
{
  vec4 place = list_texel(marks, gl_InstanceID, 1, 0);
  probe = gl_InstanceID;
  normal_world = corner;
  position_world = place.xyz + place.w * corner;
  gl_Position = overlay.clip_from_world * vec4(position_world, 1.0);
}
