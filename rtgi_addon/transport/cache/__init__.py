"""The surface cache: texels on every surface, the rays between them, and the light that these rays carry.

It stands on `paths/` and everything below. What stores light at surfaces for others to read comes in here.
"""
