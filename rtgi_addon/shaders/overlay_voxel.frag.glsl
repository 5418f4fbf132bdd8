// What a voxel's face shows; nothing of faces that block nothing.
#include "include/overlay.glsl"

void main()
{
  if (tint.w == 0.0 || overlay_hidden(position_world)) {
    discard;
  }
  color = vec4(tint.rgb, 1.0);
}
