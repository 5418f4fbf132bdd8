"""Light and geometry (rank 2), in wings: `surfaces` below `rays` and `lights`, below `media`, below `context`, below `paths`,
`cache`, `views`.

A wing imports lower wings and itself. What carries light from a scene and belongs to no single technique comes in here.
"""
