"""Reflection probes: the radiance that arrives at Blender's Light Probe Spheres, baked once for every view, and its look-up, which
reflections fall back on where the picture and rays say nothing. `maps` holds and reads it, `prefilter` blurs it by GGX lobes,
`bake` makes it. What else is baked for mirrors of every view comes in here."""
