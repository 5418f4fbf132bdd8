// A ball that mirrors what its probe saw, as sharp as it is held and from infinitely far.
#include "include/sphere_textures.glsl"
#include "include/overlay.glsl"

void main()
{
  if (overlay_hidden(position_world)) {
    discard;
  }
  vec3 along = overlay.orthographic != 0 ? overlay.forward_world : position_world - overlay.position_world;
  color = vec4(rtgi_sphere_level(probe, 0, reflect(along, normalize(normal_world))), 1.0);
}
