// Volumes as atlases: Z slices as tiles, columns of tiles from left to right, rows from bottom to top (preview/atlas.py).

ivec2 atlas_texel(ivec3 cell, ivec3 resolution, int columns)
{
  return ivec2(cell.z % columns * resolution.x + cell.x, cell.z / columns * resolution.y + cell.y);
}

// The cell of a texel; its z is beyond the volume in tiles that stand for no slice.
ivec3 atlas_cell(ivec2 texel, ivec3 resolution, int columns)
{
  ivec2 tile = texel / resolution.xy;
  return ivec3(texel - tile * resolution.xy, tile.y * columns + tile.x);
}

bool is_inside(ivec3 cell, ivec3 resolution)
{
  return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, resolution));
}
