// A triangle of one instance to clip space. Six texels an instance: rows of world_from_local, rows of the normal matrix with the
// instance's first triangle (high, low 16 bits) and its index in their fourth components.
#include "include/list.glsl"

void main()
{
  int instance = int(material.surface.y) + gl_InstanceID;
  vec4 row_x = list_texel(instances, instance, 6, 0);
  vec4 row_y = list_texel(instances, instance, 6, 1);
  vec4 row_z = list_texel(instances, instance, 6, 2);
  vec4 normal_x = list_texel(instances, instance, 6, 3);
  vec4 normal_y = list_texel(instances, instance, 6, 4);
  vec4 normal_z = list_texel(instances, instance, 6, 5);
  vec4 local = vec4(position, 1.0);
  position_world = vec3(dot(row_x, local), dot(row_y, local), dot(row_z, local));
  mat3 normal_matrix = transpose(mat3(normal_x.xyz, normal_y.xyz, normal_z.xyz));
  face_normal_world = normal_matrix * face_normal;
#ifdef SMOOTH
  normal_world = normal_matrix * normal;
#endif
  instance_index = int(normal_z.w);
  primitive = int(normal_x.w) * 65536 + int(normal_y.w) + triangle;
  COPY_UVS
  COPY_COLORS
  gl_Position = view.clip_from_world * vec4(position_world, 1.0);
}
