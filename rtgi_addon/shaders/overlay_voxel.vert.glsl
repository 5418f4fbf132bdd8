// A cube about each voxel. A voxel: (centre, half of its side), then what each of its faces shows, six corners a face.
#include "include/list.glsl"

void main()
{
  vec4 place = list_texel(marks, gl_InstanceID, 7, 0);
  tint = list_texel(marks, gl_InstanceID, 7, 1 + gl_VertexID / 6);
  position_world = place.xyz + place.w * corner;
  gl_Position = overlay.clip_from_world * vec4(position_world, 1.0);
}
