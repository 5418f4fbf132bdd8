"""The compiled inner loops: what a bake spends its time on, in C (``src/``), called through ctypes, which lets other threads run.

What comes in is a function over arrays in ``src/``, a line in ``library.SIGNATURES``, and a call of it beside the numpy code that
it stands for, which tests hold it to and which runs wherever the library is missing: same rays, same estimator, floats apart by
rounding. ``is_available`` says whether the library is there, ``missing`` why not; ``RTGI_KERNELS=off`` does without it, and
``RTGI_KERNELS=PATH`` takes another build. ``tools/build_kernels.py`` builds it.
"""

from .library import call, is_available, missing, switched_off

__all__ = ["call", "is_available", "missing", "switched_off"]
