"""Contexts of OpenGL beside Blender's own."""

import ctypes
from contextlib import contextmanager


@contextmanager
def current_context_kept():
    """Blender goes on working in whatever EGL context is current: give it back its own."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        yield
        return
    for name in ("eglGetCurrentDisplay", "eglGetCurrentSurface", "eglGetCurrentContext"):
        getattr(egl, name).restype = ctypes.c_void_p
    draw, read = (egl.eglGetCurrentSurface(which) for which in (0x3059, 0x305A))
    before = egl.eglGetCurrentDisplay(), draw, read, egl.eglGetCurrentContext()
    try:
        yield
    finally:
        if before[0]:
            egl.eglMakeCurrent(*map(ctypes.c_void_p, before))
