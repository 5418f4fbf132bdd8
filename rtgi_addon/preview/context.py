"""Whether there is a GPU to work on, and why not.

Blender's gpu module answers only on the main thread of a Blender that has opened a context: one with a window always has; one
without opens it by ``gpu.init`` (from 5.2) or by rendering once with an engine that asks for it (before), which is for the folder
`blender` to do.
"""

import ctypes
import sys
import threading

from ..errors import BakeError

REMEDY = ("start Blender with a window, install an OpenGL 4.3 or Vulkan driver (Debian's software ones: apt-get install libegl1 "
          "libgl1-mesa-dri), or use --device cpu")

_EGL_OPENGL_API, _EGL_PLATFORM_SURFACELESS = 0x30A2, 0x31DD
_CONFIG = (0x3033, 0x0001, 0x3040, 0x0008, 0x3038)  # surface type: pbuffer; renderable type: OpenGL
_CONTEXT = (0x3098, 4, 0x30FB, 3, 0x30FD, 1, 0x3038)  # OpenGL 4.3, core profile


def is_open() -> bool:
    """True if Blender's gpu module can be used on this thread."""
    try:
        import gpu
        gpu.platform.backend_type_get()
    except (ImportError, SystemError):
        return False
    return True


def initialise() -> bool:
    """Open the context by ``gpu.init`` where this Blender has it (from 5.2); False where it must be done by rendering."""
    import gpu
    if not hasattr(gpu, "init"):
        return False
    gpu.init()
    return True


def require() -> None:
    """Raise BakeError unless the GPU can be used here and now."""
    try:
        import gpu
    except ImportError:
        raise BakeError("the GPU is used through Blender, which is not here", "run inside Blender, or use --device cpu") from None
    if threading.current_thread() is not threading.main_thread():
        raise BakeError("the GPU was asked for on a thread of its own", "Blender's GPU works on its main thread only")
    try:
        backend = gpu.platform.backend_type_get()
    except SystemError:
        raise BakeError("Blender has no GPU context", REMEDY) from None
    if backend in ("NONE", "UNKNOWN"):
        raise BakeError("Blender has found no GPU it can use", REMEDY)


def description() -> str:
    """Backend, renderer and driver version, as one line."""
    import gpu
    return f"{gpu.platform.backend_type_get()}, {gpu.platform.renderer_get()}, {gpu.platform.version_get()}"


def require_driver(vulkan: bool = False) -> None:
    """Raise BakeError where Blender without a window would find no GPU: there it ends the process instead of saying so.

    Tries on Linux what Blender is about to do: a device of Vulkan, if it was told to use ``vulkan`` (without one it goes on with
    OpenGL); a context of OpenGL 4.3 on EGL's default display, or on one without surfaces (GHOST_ContextEGL.cc).
    """
    if not sys.platform.startswith("linux") or (vulkan and _has_vulkan_device()):
        return
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        raise BakeError("there is no libEGL.so.1, through which Blender opens a GPU without a window", REMEDY) from None
    for name in ("eglGetDisplay", "eglGetPlatformDisplay", "eglCreateContext"):
        getattr(egl, name).restype = ctypes.c_void_p
    if not _gives_context(egl, egl.eglGetDisplay(None)) and not _gives_context(
            egl, egl.eglGetPlatformDisplay(_EGL_PLATFORM_SURFACELESS, None, None)):
        raise BakeError("no driver here gives an OpenGL 4.3 context without a window", REMEDY)


def _has_vulkan_device() -> bool:
    try:
        vulkan = ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return False
    # VkInstanceCreateInfo: its type (1) and no application, layers or extensions.
    create_info, instance, count = (ctypes.c_uint64 * 8)(1), ctypes.c_void_p(), ctypes.c_uint32()
    if vulkan.vkCreateInstance(create_info, None, ctypes.byref(instance)) != 0:
        return False
    vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    vulkan.vkDestroyInstance(instance, None)
    return count.value > 0


def _gives_context(egl, display: int | None) -> bool:
    display = ctypes.c_void_p(display)
    if not display or not egl.eglInitialize(display, None, None) or not egl.eglBindAPI(_EGL_OPENGL_API):
        return False
    config, count = ctypes.c_void_p(), ctypes.c_int()
    chosen = egl.eglChooseConfig(display, (ctypes.c_int * len(_CONFIG))(*_CONFIG), ctypes.byref(config), 1, ctypes.byref(count))
    if not chosen or count.value == 0:
        return False
    opened = ctypes.c_void_p(egl.eglCreateContext(display, config, None, (ctypes.c_int * len(_CONTEXT))(*_CONTEXT)))
    if opened:
        egl.eglDestroyContext(display, opened)
    return bool(opened)
