// What glossy layers reflect by a cone through lit voxels (effects/voxel_reflections.py, mirrored).
#include "include/reflected_look.glsl"
#include "include/voxel_cones.glsl"
#include "include/voxel_sky.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec4 lit = texelFetch(light, texel, 0);
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  if (dot(normal, normal) > 0.0) {
    Mirror mirror = pixel_mirror(texel);
    float alpha = min(mirror.look.alpha, cone.max_alpha);
    float spread = 2.0 * alpha / (1.0 - alpha * alpha);
    vec3 start = (mirror.point - indirect.corner.xyz) / indirect.corner.w;
    VoxelRay ray;
    vec3 direction = 2.0 * dot(normal, mirror.towards_eye) * normal - mirror.towards_eye;
    // Below the surface itself nothing is met: along it.
    ray.direction = normalize(direction - 1.02 * min(dot(direction, mirror.face), 0.0) * mirror.face);
    ray.normal = mirror.face;
    ray.surface = true;
    vec3 shown = vec3(0.0);
    float left = 1.0;
    for (int grid = 0; grid < VOXEL_GRIDS && left > 0.0; grid++) {
      float share = voxel_share(grid, start, left);
      if (share > 0.0) {
        ray.grid = grid;
        ray.start = voxel_place(0, grid, start);
        VoxelsSeen seen = voxel_cone(ray, spread, cone.step, cone.near);
        shown += share * (seen.radiance + (seen.passed > 0.0 ? seen.passed * voxel_beyond(ray, spread) : vec3(0.0)));
      }
    }
    vec3 taken = texelFetch(gbuffer_albedo, texel, 0).rgb - mirror.look.diffuse;
    lit.rgb += mirror.look.layer * shown - taken * texelFetch(indirect_irradiance, texel, 0).rgb * INVERSE_PI;
    lit.rgb = max(lit.rgb, vec3(0.0));
  }
  imageStore(result, texel, lit);
}
