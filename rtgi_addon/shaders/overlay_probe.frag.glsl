// The sphere as a white Lambert surface in the probe's own light, or in the colour of its state.
#include "include/list.glsl"
#include "include/sh.glsl"
#include "include/overlay.glsl"

#define PROBE_TEXELS (2 + 3 * SH_BLOCKS)

void main()
{
  if (overlay_hidden(position_world)) {
    discard;
  }
  vec3 normal = normalize(normal_world);
  if (overlay.shading == 0) {
    vec4 basis[SH_BLOCKS];
    sh_basis(normal, basis);
    vec3 irradiance = vec3(0.0);
    for (int block = 0; block < SH_BLOCKS; block++) {
      irradiance += vec3(dot(basis[block], list_texel(marks, probe, PROBE_TEXELS, 2 + block)),
                         dot(basis[block], list_texel(marks, probe, PROBE_TEXELS, 2 + SH_BLOCKS + block)),
                         dot(basis[block], list_texel(marks, probe, PROBE_TEXELS, 2 + 2 * SH_BLOCKS + block)));
    }
    color = vec4(max(irradiance, 0.0) * 0.31830988618, 1.0);
    return;
  }
  // Lit from the eye, so that it looks like a sphere.
  float facing = abs(dot(normal, overlay.forward_world));
  color = vec4(list_texel(marks, probe, PROBE_TEXELS, 1).rgb * (0.4 + 0.6 * facing), 1.0);
}
