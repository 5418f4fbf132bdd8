"""The light atlas: light at the texels of objects' UV maps, a directional lightmap. What lays maps out on a sheet, gathers light on
it, closes its seams and reads it comes in here; it is no effect of pictures, but gathers light as they do, media among it.
"""
