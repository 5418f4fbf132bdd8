// A triangle seen along an axis of the grid of voxels, a pixel for each line (transport/voxels/crossings.py, crossings).

void main()
{
  int across = (parameters.axis + 1) % 3;
  int along = (parameters.axis + 2) % 3;
  met = vec3(corner[parameters.axis], place);
  primitive = triangle;
  vec2 side = vec2(parameters.resolution[across], parameters.resolution[along]);
  gl_Position = vec4(2.0 * vec2(corner[across], corner[along]) / side - 1.0, 0.0, 1.0);
}
