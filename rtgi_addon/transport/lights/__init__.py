"""What gives light: lamps, emissive surfaces, the world; each as what a sampler, a shadow ray or a path from it needs.

Lights know surfaces and no rays. A new kind of light comes in here.
"""
