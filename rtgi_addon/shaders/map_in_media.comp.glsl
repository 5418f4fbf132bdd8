// What media leave of a lamp's light on its way to what its map shows (transport/views/reflective_shadow_map.py).
#include "include/media.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, parameters.size))) {
    return;
  }
  vec4 flux = texelFetch(map_flux, texel, 0);
  if (flux.rgb != vec3(0.0)) {
    vec3 point = texelFetch(map_position, texel, 0).xyz;
    vec3 towards = parameters.eye - point;
    float away = length(towards);
    if (parameters.orthographic != 0) {
      away = -dot(towards, parameters.forward);
      towards = -parameters.forward;
    }
    away = parameters.distant != 0 ? 2.0 * MEDIA_FAR : away;
    flux.rgb *= media_transmittance(parameters.media, point, normalize(towards), away);
  }
  imageStore(left, texel, flux);
}
