// A shadow map's texel: the nearest surface's depth along the view [m]; 0 stands for nothing.
#include "include/material.glsl"
#include "include/fragment.glsl"

void main()
{
  if (material.surface.z != 0.0 && is_transparent(alpha_image, primitive)) {
    discard;
  }
  out_depth = vec4(dot(position_world - view.position_world, view.forward_world), 0.0, 0.0, 0.0);
  gl_FragDepth = linear_depth();
}
