// A sphere about each probe. A probe: (position, radius), the colour of its state, its SH channel by channel.
#include "include/list.glsl"
#include "include/sh.glsl"

#define PROBE_TEXELS (2 + 3 * SH_BLOCKS)

void main()
{
  vec4 place = list_texel(marks, gl_InstanceID, PROBE_TEXELS, 0);
  probe = gl_InstanceID;
  normal_world = corner;
  position_world = place.xyz + place.w * corner;
  gl_Position = overlay.clip_from_world * vec4(position_world, 1.0);
}
