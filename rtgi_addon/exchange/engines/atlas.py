"""The light atlas of a bundle made ready for an engine, and what the engine's look-up is held to."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...effects.atlas.coefficients import COUNT, irradiance_weights
from ...effects.atlas.sheet import LightAtlas, bilinear
from ...effects.atlas.unwrapped import Part
from ...errors import BakeError
from .axes import Axes
from .conformance import BUNDLE, KIT, POINTS
from .kit import unit
from .volumes import to_half

SCHEMA = "rtgi-atlas-conformance/1"
_GLSL = Path(__file__).resolve().parents[2] / "shaders" / "include" / "light_atlas.glsl"
# Of what rounding in float32 changes in sums, and in places on the sheet [texels].
_FLOAT, _NUDGE = 1e-4, 2e-5


@dataclass(frozen=True, eq=False)
class EngineAtlas:
    """``coefficients`` (height, width, COUNT, 3) float16 of radiance in the engine's axes, and the ``parts`` of the sheet."""

    coefficients: np.ndarray
    parts: tuple[Part, ...]
    source: LightAtlas | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in texels."""
        return self.coefficients.shape[:2]

    @property
    def slices(self) -> np.ndarray:
        """(3, height, width, 4) float16: the four coefficients of red, of green and of blue."""
        return np.ascontiguousarray(self.coefficients.transpose(3, 0, 1, 2))

    @property
    def entries(self) -> list[dict]:
        """What scripts have to know of each part: places on the sheet [texels] are its texture coordinates · scale + offset."""
        return [{"name": part.name, "texcoord": part.texcoord, "scale": part.scale, "offset": part.offset.tolist()}
                for part in self.parts]

    def irradiance(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n, 3) float64: what the engine is to find at ``places`` (n, 2) [texels] under unit ``normals`` (n, 3) of its axes."""
        found = np.einsum("nk,nkc->nc", irradiance_weights(normals), bilinear(self.coefficients, places))
        return np.maximum(found, 0.0)


def engine_atlas(atlas: LightAtlas | None, axes: Axes) -> EngineAtlas | None:
    """``atlas`` along ``axes``; None for none. Raises BakeError for light that half floats do not hold."""
    if atlas is None:
        return None
    height, width = atlas.sheet.size
    turned = axes.harmonics(atlas.coefficients.reshape(-1, COUNT, 3)).reshape(height, width, COUNT, 3)
    return EngineAtlas(to_half(turned, "the light atlas"), atlas.sheet.parts, atlas)


def require_texture(atlas: EngineAtlas, largest: int, engine: str) -> None:
    """Raise BakeError where the sheet does not fit ``engine``'s textures."""
    height, width = atlas.size
    if max(height, width) > largest:
        part = max(atlas.parts, key=lambda part: part.width * part.height)
        raise BakeError(f"the light atlas has {width} x {height} texels, {part.width} x {part.height} of them for {part.name}, "
                        f"and {engine} takes {largest} along a side", "bake it with a lower Density (--set atlas.density)")


def notes_on_atlas(atlas: EngineAtlas | None, most_texcoords: int, engine: str) -> list[str]:
    """What a user should know of ``atlas`` in ``engine``, which reads UV maps up to ``most_texcoords``."""
    if atlas is None:
        return []
    far = [part.name for part in atlas.parts if part.texcoord >= most_texcoords]
    notes = [f"{engine} reads the first {most_texcoords} UV maps of a mesh, and the light atlas of {', '.join(far)} lies in "
             "another, so the probes light it: move the map up in Object Data > UV Maps"] if far else []
    return notes


def atlas_glsl() -> str:
    """The look-up for shaders that have rtgi_atlas_texel and RTGI_ATLAS_SIZE."""
    return _GLSL.read_text(encoding="utf-8")


@cache
def kit_atlas() -> EngineAtlas:
    """Two parts of noise, of which the second reads another UV map."""
    rng = np.random.default_rng(31)
    coefficients = rng.normal(size=(20, 28, COUNT, 3)) * 0.3
    coefficients[:, :, 0] = 2.0 + rng.random((20, 28, 3)) * 2.0
    parts = (Part("Kit Floor", -1, "Lightmap", 0, 0, 0, 16, 20, 12.0, np.array([2.0, 3.5])),
             Part("Kit Wall", -1, "Lightmap", 1, 16, 0, 12, 12, 8.0, np.array([18.0, 2.0])))
    return EngineAtlas(to_half(coefficients, "the kit"), parts)


def conformance_json(atlas: EngineAtlas) -> dict:
    """The contents of an export's conformance file of the light atlas."""
    return {"schema": SCHEMA, "unit": "W/m^2", "cases": [_case("kit, light atlas", KIT, kit_atlas()),
                                                       _case("bundle, light atlas", BUNDLE, atlas)]}


def _case(name: str, source: str, atlas: EngineAtlas) -> dict:
    asked = asked_of(atlas)
    return {"name": name, "atlas": source, **asked.to_json(atlas), **answers(atlas, asked)}


class Asked(NamedTuple):
    """POINTS places of a sheet: the ``part`` (n,) of each, its map's coordinates ``st`` (n, 2) float32, ``places`` (n, 2) [texels]
    and ``normals`` (n, 3) float32."""

    part: np.ndarray
    st: np.ndarray
    places: np.ndarray
    normals: np.ndarray

    def to_json(self, atlas: EngineAtlas) -> dict:
        """What scripts inside the engine are asked."""
        names = [atlas.parts[index].name for index in self.part]
        return {"parts": names, "st": _rounded(self.st), "normals": _rounded(self.normals)}


def asked_of(atlas: EngineAtlas) -> Asked:
    """Places of all parts of ``atlas``, on the sheet's own edge too."""
    rng = np.random.default_rng(32)
    part = rng.integers(len(atlas.parts), size=POINTS)
    low = np.array([[entry.x, entry.y] for entry in atlas.parts])[part]
    size = np.array([[entry.width, entry.height] for entry in atlas.parts])[part]
    scale, offset = (np.array([getattr(entry, key) for entry in atlas.parts])[part] for key in ("scale", "offset"))
    st = ((low + rng.random((POINTS, 2)) * size - offset) / scale[:, None]).astype(np.float32)
    places = st.astype(np.float64) * scale[:, None] + offset
    return Asked(part, st, places, unit(rng.normal(size=(POINTS, 3))).astype(np.float32))


def answers(atlas: EngineAtlas, asked: Asked, rounding: np.ndarray | float = 0.0) -> dict:
    """Irradiance of ``atlas`` where it is ``asked``, and its tolerance; ``rounding`` (n, 3) comes on top."""
    normals = unit(asked.normals.astype(np.float64))
    found, spread = atlas.irradiance(asked.places, normals), np.zeros((POINTS, 3))
    for nudge in _NUDGE * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]):
        spread = np.maximum(spread, np.abs(atlas.irradiance(asked.places + nudge, normals) - found))
    tolerance = 4.0 * spread + _FLOAT * (np.abs(found) + 0.05 * found.max(initial=0.0)) + 1e-9 + rounding
    return {"irradiance": _rounded(found), "tolerance": _rounded(tolerance)}


def _rounded(rows: np.ndarray) -> list[list[float]]:
    return [[float(f"{value:.9g}") for value in row] for row in rows]
