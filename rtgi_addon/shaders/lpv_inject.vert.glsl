// Virtual lights from lists.
#include "include/lpv_inject.glsl"

void main()
{
  inject_light(cell_position, normal, flux);
}
