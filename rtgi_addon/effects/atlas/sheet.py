"""A finished light atlas, and how it is read: four texels and a normal, the same in numpy, Godot and three.js."""

from dataclasses import dataclass

import numpy as np

from .coefficients import COUNT, irradiance_weights
from .matrices import AtlasTransfer
from .unwrapped import Part, Sheet


@dataclass(frozen=True, eq=False)
class LightAtlas:
    """``coefficients`` (height, width, COUNT, 3) float32 of radiance that arrives at texels, world axes, 0 where none is known;
    ``known`` (height, width) bool tells texels that rays left from. ``irradiance`` (height, width, 3) float32 is that under each
    texel's own normal [W·m⁻²], for readers that know no normals. ``transfer`` (None: not known) is what texels make of
    any light."""

    sheet: Sheet
    coefficients: np.ndarray
    irradiance: np.ndarray
    known: np.ndarray
    transfer: AtlasTransfer | None = None

    def part(self, name: str) -> Part:
        """The part of the object called ``name``."""
        return next(part for part in self.sheet.parts if part.name == name)

    def read(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) float64 [W·m⁻²] at ``places`` (n, 2) on the sheet [texels] under unit ``normals`` (n, 3)."""
        total = bilinear(self.coefficients, places)
        return np.maximum(np.einsum("nk,nkc->nc", irradiance_weights(normals), total), 0.0)


def light_atlas(sheet: Sheet, image: np.ndarray, known: np.ndarray, transfer: AtlasTransfer | None = None) -> LightAtlas:
    """The atlas of an ``image`` (height, width, 3·COUNT + 3): each texel's coefficients, then its irradiance."""
    height, width = sheet.size
    coefficients = image[..., :3 * COUNT].reshape(height, width, COUNT, 3)
    return LightAtlas(sheet, np.ascontiguousarray(coefficients), np.maximum(image[..., 3 * COUNT:], 0.0), known, transfer)


def bilinear(image: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n, …) float64: ``image`` (height, width, …) between texels at ``places`` (n, 2)."""
    index, weight = corners_of(places, image.shape[:2])
    flat = image.reshape(-1, *image.shape[2:])
    return np.einsum("ni,ni...->n...", weight, flat[index].astype(np.float64))


def corners_of(places: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """The four texels (n, 4) about ``places`` (n, 2) of a sheet of ``size`` (height, width), and their weights (n, 4)."""
    height, width = size
    place = np.asarray(places, np.float64) - 0.5
    low = np.floor(place)
    f = place - low
    column = np.clip(low[:, :1].astype(np.int64) + np.array([0, 1, 0, 1]), 0, width - 1)
    row = np.clip(low[:, 1:].astype(np.int64) + np.array([0, 0, 1, 1]), 0, height - 1)
    across = np.stack([1.0 - f[:, 0], f[:, 0], 1.0 - f[:, 0], f[:, 0]], axis=1)
    down = np.stack([1.0 - f[:, 1], 1.0 - f[:, 1], f[:, 1], f[:, 1]], axis=1)
    return row * width + column, across * down
