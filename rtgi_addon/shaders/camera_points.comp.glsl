// What a lattice of pixels of a G-buffer sees (preview/camera_points.py, lattice_pixels): surfaces without their mirrors, as points that
// lamps and indirect light are then asked about.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, points.count))) {
    return;
  }
  ivec2 pixel = points.corner + (texel * points.extent + points.shift) / points.count;
  vec4 position = texelFetch(gbuffer_position, pixel, 0);
  vec4 normal = texelFetch(gbuffer_normal, pixel, 0);
  vec4 albedo = texelFetch(gbuffer_albedo, pixel, 0);
  vec4 emission = texelFetch(gbuffer_emission, pixel, 0);
  vec4 geometry = texelFetch(gbuffer_geometry, pixel, 0);
  imageStore(point_position, texel, position);
  imageStore(point_normal, texel, normal);
  imageStore(point_albedo, texel, albedo);
  imageStore(point_emission, texel, emission);
  // What a layer reflects goes one way, and voxels send light to all sides.
  imageStore(point_geometry, texel, vec4(geometry.xyz, 0.0));
}
