// What every raster pass over the scene needs to know of a fragment.

// +1 where the mesh's front is seen, -1 where its back is.
float facing_side()
{
  vec3 towards = view.orthographic != 0 ? -view.forward_world : view.position_world - position_world;
  return dot(face_normal_world, towards) < 0.0 ? -1.0 : 1.0;
}

// The shading normal on the side that is seen.
vec3 facing_normal()
{
#ifdef SMOOTH
  vec3 shading = normal_world;
  if (dot(shading, shading) == 0.0) {
    shading = face_normal_world;
  }
#else
  vec3 shading = face_normal_world;
#endif
  return facing_side() * shading / max(length(shading), 1e-30);
}

// Depth that a 32-bit float resolves evenly from the near to the far plane: a window's own is spent within the first metre.
float linear_depth()
{
  return view.orthographic != 0 ? gl_FragCoord.z : 1.0 / (gl_FragCoord.w * view.far);
}

// A triangle's index in two floats that hold it exactly; 0 stands for nothing.
vec2 encoded_primitive(int index)
{
  return vec2(float((index + 1) >> 16), float((index + 1) & 65535));
}

// The same with the material's index above it, 8 bits in each (transport/views/gbuffer.py).
vec2 encoded_surface(int index, int material_index)
{
  return encoded_primitive(index) + 65536.0 * vec2(float(material_index >> 8), float(material_index & 255));
}
