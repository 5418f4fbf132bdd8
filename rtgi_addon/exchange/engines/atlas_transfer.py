"""What texels of a light atlas make of any light, made ready for an engine: for every texel a table, a column for each light.

A column is a texel's coefficients of red, green and blue under one light of strength 1, and what it sees of a sun itself: a light
of the file as it was baked, a harmonic of the sky, or a sun's direction. Engines multiply columns by what light there is and add
them up (`atlas_relight.glsl`). A sky comes as for probes (transfer.py): what it has beyond harmonics, as suns of the probes' dome,
is shared among the atlas's own directions as any sun is.
"""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from ...effects.atlas.coefficients import COUNT, irradiance_weights
from ...effects.atlas.matrices import NUMBERS, AtlasTransfer
from ...effects.atlas.sheet import bilinear
from ...numerics import dome, sh
from ...techniques.transfer.data import Transfer
from ...techniques.transfer.lighting import Lighting, Sky
from ...techniques.transfer.relight import light_factors
from .atlas import EngineAtlas, answers, asked_of, kit_atlas
from .axes import Axes
from .conformance import BUNDLE, KIT
from .transfer import half_scales
from .transfer_conformance import kit_transfer, light_json, lightings

SCHEMA = "rtgi-atlas-relight-conformance/1"
# Red, green and blue, and what is seen of a sun.
PARTS = 4
# Tables beyond this many bytes are no game's.
MOST_BYTES = 256 << 20
# Halves are rounded, or cut, once as they are drawn.
_HALF = 2.0**-10
_KIT_SIDE = 3


@dataclass(frozen=True, eq=False)
class EngineAtlasTransfer:
    """``tables`` (C, PARTS, height, width, COUNT) float16 along an engine's ``axes``, of which column c is stored over ``scales``
    (C,). Columns are ``lights`` ((name, kind) each), ``sky_count`` harmonics of the sky, then the suns of a dome of
    ``sun_side`` nodes a side (0: none; numerics/dome.py, in Blender's axes), twice as many with ``sun_below``."""

    axes: Axes
    tables: np.ndarray
    scales: np.ndarray
    lights: tuple[tuple[str, str], ...]
    sky_count: int
    sun_side: int
    sun_below: bool

    @property
    def slices(self) -> np.ndarray:
        """(PARTS·C, height, width, COUNT) float16: the parts of one column after the other's."""
        return self.tables.reshape(-1, *self.tables.shape[2:])

    def to_json(self) -> dict:
        """What a loader has to know besides the tables."""
        return {"lights": [{"name": name, "kind": kind} for name, kind in self.lights], "sky": self.sky_count,
                "sunSide": self.sun_side, "sunBelow": self.sun_below, "scales": [float(f"{value:.9g}") for value in self.scales]}

    def coefficients(self, transfer: Transfer, lighting: Lighting, sky: Sky | None) -> np.ndarray:
        """(height, width, COUNT, 3) float64 of the texels under ``lighting``, as an engine adds them up; ``transfer`` is that of
        the probes."""
        light, seen = self._shining(transfer, lighting, sky)
        tables = self.tables.astype(np.float64)
        total = np.einsum("cphwk,cp->hwkp", tables[:, :3], light * self.scales[:, None])
        return total + np.einsum("chwk,cp->hwkp", tables[:, 3], seen * self.scales[:, None])

    def _shining(self, transfer: Transfer, lighting: Lighting, sky: Sky | None) -> tuple[np.ndarray, np.ndarray]:
        """What (C, 3) each column is multiplied by, and what (C, 3) is seen of it as a sun."""
        harmonics, suns = np.zeros((self.sky_count, 3)), np.zeros((len(self.scales) - len(self.lights) - self.sky_count, 3))
        if sky is not None:
            harmonics = self.axes.harmonics(sky.coefficients)
            self._share(suns, transfer.sun_directions, np.asarray(sky.suns, np.float64))
        seen = np.concatenate([np.zeros((len(self.lights) + self.sky_count, 3)), suns])
        for sun in lighting.suns or ():
            self._share(suns, np.asarray(sun.towards)[None], np.asarray(sun.irradiance, np.float64)[None])
        return np.concatenate([light_factors(transfer, lighting), harmonics, suns]), seen

    def _share(self, suns: np.ndarray, towards: np.ndarray, irradiance: np.ndarray) -> None:
        if self.sun_side:
            index, share = dome.weights(towards, self.sun_side, self.sun_below)
            np.add.at(suns, index, share[:, :, None] * irradiance[:, None])


def engine_atlas_transfer(atlas: EngineAtlas | None, transfer: Transfer | None, axes: Axes,
                          largest: int) -> tuple[EngineAtlasTransfer | None, tuple[str, ...]]:
    """What the texels of ``atlas`` make of the lights of ``transfer`` along ``axes``, and what a user should know of it: None where
    it is not known, or more than an engine should hold, or than ``largest`` slices of a texture."""
    matrices = None if atlas is None or atlas.source is None or transfer is None else atlas.source.transfer
    if matrices is None:
        return None, ()
    columns = matrices.lights.shape[-1] + matrices.sky.shape[-1] + matrices.seen.shape[-1]
    height, width = atlas.size
    size = 2 * COUNT * PARTS * columns * height * width
    if size > MOST_BYTES or PARTS * columns > largest:
        return None, (f"the light atlas keeps the light of the bake: to follow others it would take {size / 2**20:.0f} MiB in "
                      f"{PARTS * columns} layers, and {MOST_BYTES >> 20} MiB in {largest} are the most; bake it with a lower "
                      "Density (--set atlas.density), or fewer Sun Directions (--set atlas.suns)",)
    notes = [f"relighting the light atlas takes {size / 2**20:.1f} MiB of tables, {size / height / width / 1000:.1f} kB a texel"]
    if not matrices.follows_suns:
        notes.append("the light atlas follows no suns: bake it with --set atlas.suns=8")
    return _tables_of(matrices, transfer.lights, axes), tuple(notes)


def _tables_of(matrices: AtlasTransfer, lights: tuple[tuple[str, str], ...], axes: Axes) -> EngineAtlasTransfer:
    """Tables of ``matrices``, whose columns of lights are called ``lights``, along ``axes``."""
    turned = axes.harmonics(np.eye(matrices.sky.shape[-1])[:, :, None])[..., 0]
    sky = (matrices.bounce + matrices.sky[None]) @ turned
    coloured = np.concatenate([np.moveaxis(part[:, :, :, :COUNT], -1, 0) for part in (matrices.lights, sky, matrices.suns)])
    first, columns = len(coloured) - matrices.seen.shape[-1], len(coloured)
    tables = np.zeros((columns, PARTS, *coloured.shape[2:]), np.float32)
    tables[:, :3], tables[first:, 3] = coloured, np.moveaxis(matrices.seen[:, :, :COUNT], -1, 0)
    tables = axes.harmonics(tables.reshape(-1, COUNT, 1)).reshape(tables.shape)
    scales = half_scales(np.abs(tables).max(axis=(1, 2, 3, 4), initial=0.0))
    tables /= scales[:, None, None, None, None]
    return EngineAtlasTransfer(axes, tables.astype(np.float16), scales, lights, matrices.sky.shape[-1], matrices.sun_side,
                               matrices.sun_below)


def relight_glsl() -> str:
    """The sum for shaders that have rtgi_atlas_column and rtgi_entry."""
    return (Path(__file__).parent / "atlas_relight.glsl").read_text(encoding="utf-8")


@cache
def kit_atlas_transfer(axes: Axes) -> EngineAtlasTransfer:
    """Tables of noise for the kit's atlas, beside those of the kit's probes, of fewer suns."""
    rng, transfer, (height, width) = np.random.default_rng(41), kit_transfer(), kit_atlas().size
    skies, suns = sh.coefficient_count(transfer.sky_order), 2 * _KIT_SIDE**2

    def matrices(*shape: int) -> np.ndarray:
        values = 0.2 * rng.normal(size=shape)
        values[..., 0, :] = np.abs(values[..., 0, :]) + 0.4
        return values.astype(np.float32)

    size = height, width, NUMBERS
    of_texels = AtlasTransfer(transfer.sky_order, _KIT_SIDE, True, matrices(*size, skies), matrices(3, *size, skies),
                              matrices(3, *size, suns), matrices(*size, suns), 2.0 * matrices(3, *size, len(transfer.lights)))
    return _tables_of(of_texels, transfer.lights, axes)


def conformance_json(atlas: EngineAtlas, tables: EngineAtlasTransfer, transfer: Transfer, axes: Axes) -> dict:
    """The contents of an export's conformance file of a light atlas under other light."""
    return {"schema": SCHEMA, "unit": "W/m^2", "sets": [_set(KIT, kit_atlas(), kit_atlas_transfer(axes), kit_transfer(), axes),
                                                       _set(BUNDLE, atlas, tables, transfer, axes)]}


def _set(name: str, atlas: EngineAtlas, tables: EngineAtlasTransfer, transfer: Transfer, axes: Axes) -> dict:
    asked, cases = asked_of(atlas), []
    for label, lighting, sky in lightings(transfer):
        texels = tables.coefficients(transfer, lighting, sky)
        magnitude = np.einsum("nk,nkc->nc", np.abs(irradiance_weights(asked.normals)), bilinear(np.abs(texels), asked.places))
        cases.append({"name": label, "light": light_json(transfer, lighting, sky, axes),
                      **answers(replace(atlas, coefficients=texels), asked, _HALF * magnitude)})
    return {"atlas": name, **asked.to_json(atlas), "cases": cases}
