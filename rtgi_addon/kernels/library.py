"""Finds and loads the library, and calls its functions with arrays that have been looked at."""

import ctypes
import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

# As in src/library.c: goes up whenever a function's arguments or a structure change.
VERSION = 4
# The package of the wheel that carries the library, and the library's name in it.
PACKAGE = "rtgi_kernels"
FILE = {"win32": f"{PACKAGE}.dll", "darwin": f"{PACKAGE}.dylib"}.get(sys.platform, f"{PACKAGE}.so")
# What a function takes, a letter an argument: arrays of float32 (F), float64 (D), float16 (H), int32 (I), int64 (L), bytes or bool
# (B) and uint32 (U), an address of something else (p), and numbers: int64 (q), int32 (i), float (f), double (d). What it returns
# comes first (v: nothing).
SIGNATURES = {
    "intersect": "vpqFFFIFFF",
    "occluded": "vpqFFFB",
    "try_tracer": "vpFFF",
    "sobol_owen": "vUiqUUiiF",
    "shifted": "vqIqqqFiLqFF",
    "slots": "vqpqIFFBI",
    "trace": "qpqpqqqFFIIFFFIF",
    "uneven": "qqBqIL",
    "ray_points": "vqLqIqqqFFFqFIIFF",
    "octahedral_cells": "vqFiI",
    "sh_basis": "vqFiF",
    "reflected": "vqFFBFqIqFqFIffFFF",
    "project": "vqqqqFqIFFF",
    "visibility": "vqqqqBIFqIFFF",
    "spread": "vqFqqIfFF",
    "sample_lamps": "vqpqiIFFFFF",
    "lamp_light": "qpqpqiIFFFFFfiF",
    "points": "vqFqIFFF",
    "shading_normals": "vqFIIqBFqFqIFFF",
    "surface_values": "vqFFFIqpffqIqIqIIFFF",
    "connect_bright": "qpqFFFFqFFFFffFF",
    "virtual_lights": "qpqFFFqFFfF",
    "texel_points": "vpqFqFIqBIFFIFFFF",
    "texel_rays": "vppqFqFqFFFFFLIFFIFLL",
    "look_up": "qqIqBqIILL",
    "covered": "vppFIqBpqLB",
    "apart": "qppFfpqLBIpBiB",
    "lowest_irradiance": "vqiqDqDDdqqDDD",
    "project_texels": "vqqqqFqFIFF",
    "surface_look": "vFiiqFFFFFFFFFFFFF",
    "sample_reflection": "vqFFFFFFFFFF",
    "kept_light": "vqFHFfqLFFFFFF",
    "share_light": "vqqqFFFFBqFFfFF",
    "cosine_rays": "qpqpUiqqUUFFFFFFIIFFFIF",
    "gathered": "vqqFFFqLFF",
    "layer_parts": "vqqDDqFD",
    "prepare": "v",
}
_NUMBERS = {"q": ctypes.c_int64, "i": ctypes.c_int32, "f": ctypes.c_float, "d": ctypes.c_double}
_ARRAYS = {"F": ("float32",), "I": ("int32",), "L": ("int64",), "B": ("uint8", "bool"), "U": ("uint32",), "D": ("float64",),
           "H": ("float16",)}
_DTYPES = {letter: tuple(np.dtype(name) for name in names) for letter, names in _ARRAYS.items()}

_switched_off = False


class _Missing(Exception):
    """Why there is no library, as the end of a sentence."""


def is_available() -> bool:
    """Whether the library is there and may be used."""
    return not _switched_off and not isinstance(_loaded(), _Missing)


def missing() -> str | None:
    """Why there is no library here, as the end of a sentence; None where there is one."""
    if _switched_off:
        return "they are switched off"
    loaded = _loaded()
    return str(loaded) if isinstance(loaded, _Missing) else None


@contextmanager
def switched_off() -> Iterator[None]:
    """Do without the library for as long as this is open, in the whole process: what tests and benchmarks compare with."""
    global _switched_off
    before, _switched_off = _switched_off, True
    try:
        yield
    finally:
        _switched_off = before


def call(name: str, *arguments):
    """Call a function of the library. Raises TypeError for an array that is not dense or not of the type that it takes: sizes are
    checked by who calls."""
    function, letters = _loaded()[name]
    return function(*(_passed(name, letter, argument) for letter, argument in zip(letters, arguments, strict=True)))


def _passed(name: str, letter: str, argument):
    if argument is None or letter not in _DTYPES:
        return argument
    if argument.dtype not in _DTYPES[letter] or not argument.flags.c_contiguous:
        raise TypeError(f"the kernel {name} takes dense arrays of {' or '.join(_ARRAYS[letter])}, not {argument.dtype} with "
                        f"strides {argument.strides}")
    return argument.__array_interface__["data"][0]


@cache
def _loaded() -> dict | _Missing:
    """Functions and the letters of their arguments by name, or why there are none."""
    try:
        return _load(_path())
    except _Missing as reason:
        return reason


def _path() -> Path:
    wanted = os.environ.get("RTGI_KERNELS", "")
    if wanted.lower() == "off":
        raise _Missing("RTGI_KERNELS=off")
    if wanted:
        return Path(wanted)
    try:
        found = importlib.util.find_spec(PACKAGE)
    except (ImportError, ValueError):
        found = None
    for folder in (found.submodule_search_locations or ()) if found else ():
        if (Path(folder) / FILE).is_file():
            return Path(folder) / FILE
    raise _Missing(f"the package {PACKAGE} is not there")


def _load(path: Path) -> dict:
    try:
        library = ctypes.CDLL(str(path))
        version = library.rtgi_version()
        if version != VERSION:
            raise _Missing(f"{path} is of version {version}, not {VERSION}")
        variant = "avx2" if library.rtgi_has_avx2() else "base"
        functions = {name: _bound(library, f"rtgi_{name}_{variant}", letters) for name, letters in SIGNATURES.items()}
    except (OSError, AttributeError) as error:
        raise _Missing(f"{path} cannot be used ({error})") from None
    functions["prepare"][0]()
    return functions


def _bound(library: ctypes.CDLL, name: str, letters: str) -> tuple:
    function = getattr(library, name)
    function.restype = _NUMBERS.get(letters[0])
    function.argtypes = [_NUMBERS.get(letter, ctypes.c_void_p) for letter in letters[1:]]
    return function, letters[1:]
