"""A surface cache as arrays by name, and back: a resumed bake ends with the very bytes of an uninterrupted one."""

import numpy as np

from .bright import BrightSurfaces
from .form_factors import FormFactors
from .surface_cache import SurfaceCache
from .texel_rows import TexelRows


def labelled(label: str, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """``arrays`` with ``label`` and a point before every name."""
    return {f"{label}.{name}": array for name, array in arrays.items()}


def part_of(arrays: dict[str, np.ndarray], label: str) -> dict[str, np.ndarray]:
    """What ``labelled`` put into ``arrays`` under ``label``."""
    prefix = label + "."
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def cache_state(cache: SurfaceCache) -> dict[str, np.ndarray]:
    """Everything that was measured."""
    return {**labelled("table", cache.table.state()), **labelled("bright", cache.bright.arrays()),
            **labelled("rows", cache.rows.arrays()), **labelled("factors", cache.form_factors.arrays()),
            "irradiance_rest": cache.irradiance_rest, "first_bounce": cache.first_bounce,
            "bounce_halves": cache.bounce_halves, "solved": np.array(cache.solved)}


def restore_cache(cache: SurfaceCache, arrays: dict[str, np.ndarray]) -> None:
    """Take ``cache``, fresh and made as the one that gave ``arrays`` was, up to where that stood."""
    cache.table.restore(part_of(arrays, "table"))
    cache.bright = BrightSurfaces(cache.context, **part_of(arrays, "bright"))
    cache.rows = TexelRows(**part_of(arrays, "rows"))
    cache.form_factors = FormFactors.of(part_of(arrays, "factors"))
    cache.irradiance_rest, cache.first_bounce = arrays["irradiance_rest"], arrays["first_bounce"]
    cache.bounce_halves = arrays["bounce_halves"]
    cache.solved = int(arrays["solved"])
