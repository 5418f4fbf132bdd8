"""What runs on the GPU (rank 4): shader programs, textures, raster passes, and the techniques' kernels. The only importer of `gpu`.

`programs` describes every program once; `device` builds them with Blender's gpu module, and `declarations` writes the same
resources as plain GLSL for a bare OpenGL context. The bodies are files in `rtgi_addon/shaders`.
"""
