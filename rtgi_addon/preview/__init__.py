"""What runs on the GPU (rank 5): shader programs, textures, raster passes, and the techniques' kernels; the only importer of `gpu`.
A pass comes in with its program in `programs`, its body in `rtgi_addon/shaders`, and a numpy twin that a test holds it to.

`programs` describes every program once; `device` builds them with Blender's gpu module, and `declarations` writes the same
resources as plain GLSL for a bare OpenGL context. The bodies are files in `rtgi_addon/shaders`.
"""
