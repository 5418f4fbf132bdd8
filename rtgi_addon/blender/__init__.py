"""Everything that touches bpy (rank 7): reading a scene, the panel, the command line, the render engine, Cycles as a judge. Nothing
outside imports bpy, and nothing in here computes light: what does comes in below, and here as a door to it.

`extract` and `materials` end in a ``Scene``; `ui`, `cli` and `engine` are the doors to the same jobs.
"""
