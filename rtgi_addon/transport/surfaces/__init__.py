"""What a ray meets: triangles in one numbering, materials and textures at a hit, which meshes are closed solids.

The lowest wing: it knows the scene and no rays. Whatever is a property of a surface comes in here.
"""
