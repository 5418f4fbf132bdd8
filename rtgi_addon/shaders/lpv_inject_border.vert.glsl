// What coarser cascades send through a face of this one's border (techniques/lpv/sources.py, entering): `share` is the face's area.
#include "include/irradiance_lpv.glsl"
#include "include/lpv_inject.glsl"

void main()
{
  inject_light(cell_position, normal, share * lpv_cascades_irradiance(face_position, -inward, parameters.level + 1, false));
}
