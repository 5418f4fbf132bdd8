"""What techniques share that see the scene in voxels (transport/voxels): their settings, where the grid lies, the light on the
voxels, and a Field that knows what lies beyond the grid. What serves more than one of them comes in here.
"""
