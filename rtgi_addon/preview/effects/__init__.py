"""The GPU's halves of effects: what the viewport and F12 run where `rtgi_addon/effects` has the same in numpy. One that needs
passes or textures of its own comes in as a module of the effect's name that ends in ``HALF = Type``.

Any other effect has its half in ``shaders/effect_NAME.comp.glsl``, which looks at one pixel after the other (`pixel`), or else in
its own ``apply`` on the frame brought back from the GPU (`on_cpu`), which is right and slow. So it is where
``Effect.has_gpu_half`` says that a half does not do what its settings ask for.
"""

import importlib
import importlib.util
from collections.abc import Iterable

from ...effects import Chosen, in_order
from ..sources import SHADERS


def make_halves(chosen: Iterable[Chosen]) -> tuple:
    """A half (base.Half) for each of ``chosen`` in the order of their stages. GPU objects: main thread only."""
    return tuple(_make(entry) for entry in in_order(chosen))


def has_shader(name: str) -> bool:
    """True if the effect of that name is a file of GLSL."""
    return (SHADERS / f"effect_{name}.comp.glsl").is_file()


def _make(chosen: Chosen):
    # Imported late: hosts without Blender's GPU use the programs of this package.
    from .on_cpu import OnCpu
    from .pixel import PixelHalf
    name = chosen.effect.name
    if importlib.util.find_spec(f"{__name__}.{name}") is not None:
        half = getattr(importlib.import_module(f"{__name__}.{name}"), "HALF", None)
        if half is not None and chosen.effect.has_gpu_half(chosen.settings):
            return half(chosen)
    return PixelHalf(chosen) if has_shader(name) else OnCpu(chosen)
