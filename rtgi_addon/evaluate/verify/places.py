"""Where two renderers are compared: points on surfaces, and probes by small white patches all around them.

Both renderers answer with irradiance, through diffuse rays and with lamps, as everything that a bake lights is lit. Of the patches
around a probe the bands 0 and 1 of its light follow exactly: on the sphere, axes and corners of a cube with weights 1/15 and 3/40
integrate polynomials up to degree 5 (Abramowitz and Stegun 25.4.65), and irradiance has hardly any band above 4.
"""

from dataclasses import dataclass

import numpy as np

from ...errors import BakeError
from ...numerics import sh
from ...scene import ProbeVolume
from ...techniques.lattice.focus import probes_of, spacing_of
from ...transport.context import LightContext
from ..receivers import open_probes, surface_receivers

_CUBE = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], np.float64)
_OF_CUBE = _CUBE[np.isin(np.abs(_CUBE).sum(axis=1), (1, 3))]
# Unit normals (14, 3) of the patches around a probe, and their weights: shares of the sphere.
NORMALS = _OF_CUBE / np.linalg.norm(_OF_CUBE, axis=1, keepdims=True)
WEIGHTS = np.where(np.abs(_OF_CUBE).sum(axis=1) == 1, 1 / 15, 3 / 40)
# Sides of a patch, as a share of the shortest cell; how far from its probe it stands, so that none sees another; and how far above
# its surface, in its sides.
_SIDE, _APART, _ABOVE = 0.01, 2.5, 0.5
# And no smaller than this share of the coordinates: float32 tells patches and surfaces apart.
_LEAST_SIDE = 1e-5
# Tells the choice of probes apart from all other numbers of a seed: the letters ve.
_STREAM = 0x7665
# The cosine lobe's coefficients of bands 0 and 1, by coefficient (Ramamoorthi and Hanrahan 2001).
_LOBE = np.pi * np.array([1.0, 2 / 3, 2 / 3, 2 / 3])


@dataclass(frozen=True, eq=False)
class Places:
    """``points`` and ``normals`` (s + 14 p, 3) float64 of square patches with sides ``side`` [m]: s on surfaces, then those around
    each of the p ``probes`` (p, 3), which stand at the indices ``lattice`` (p,) among all probes of the volumes."""

    points: np.ndarray
    normals: np.ndarray
    side: float
    probes: np.ndarray
    lattice: np.ndarray

    @property
    def surfaces(self) -> int:
        """How many places are on surfaces."""
        return len(self.points) - len(NORMALS) * len(self.probes)

    def sites(self, values: np.ndarray) -> list[np.ndarray]:
        """``values`` (s + 14 p, …) by what shares a site: (s, 1, …) and (p, 14, …)."""
        rest = values.shape[1:]
        return [values[:self.surfaces].reshape(-1, 1, *rest), values[self.surfaces:].reshape(-1, len(NORMALS), *rest)]


def choose_places(context: LightContext, volumes: tuple[ProbeVolume, ...], surfaces: int, probes: int, seed: int = 0,
                  moved: np.ndarray | float = 0.0, in_media: bool = True) -> Places:
    """``probes`` of the volumes' probes in the open, and ``surfaces`` points on surfaces that probes see; none of them within a
    medium unless ``in_media``. ``moved`` (p, 3) is how far a bake has moved each of all probes away from geometry [m]. Raises
    BakeError where no probe is left."""
    lattice = probes_of(volumes) + moved
    usable = open_probes(context, volumes)
    if not len(usable):
        raise BakeError("no probe of the scene's volumes is in the open", "move the volumes, or make their resolution higher")
    if not in_media:
        usable = usable[~_within_media(context, lattice[usable])]
    if not len(usable):
        raise BakeError("every probe of the scene's volumes is within a medium, where Cycles' own bake has nothing to compare with",
                        "use a Blender whose Cycles has OSL, or hide the medium from renders for the comparison")
    side = max(_SIDE * spacing_of(volumes), _LEAST_SIDE * float(np.abs(lattice).max()))
    seen = surface_receivers(context, lattice[usable].astype(np.float32), surfaces, normals_per_point=1, seed=seed)
    seen = seen if in_media else seen.take(np.flatnonzero(~_within_media(context, seen.points)))
    chosen = np.sort(np.random.default_rng([seed, _STREAM]).choice(usable, min(probes, len(usable)), replace=False))
    stood = lattice[chosen]
    points = np.concatenate([seen.points + _ABOVE * side * seen.normals,
                             (stood[:, None] + _APART * side * NORMALS).reshape(-1, 3)])
    return Places(points.astype(np.float64), np.concatenate([seen.normals, np.tile(NORMALS, (len(stood), 1))]).astype(np.float64),
                  side, stood, chosen)


def _within_media(context: LightContext, points: np.ndarray) -> np.ndarray:
    within = np.zeros(len(points), bool)
    for filling in context.media.fillings:
        within |= filling.contains(np.asarray(points, np.float64))
    return within


def radiance_from_patches(irradiance: np.ndarray) -> np.ndarray:
    """SH (p, 4, 3) of the radiance that arrives at probes, from the ``irradiance`` (p, 14, 3) of the patches around each."""
    basis = sh.evaluate(NORMALS, 1).astype(np.float64)
    return 4.0 * np.pi * np.einsum("j,jk,pjc->pkc", WEIGHTS, basis, irradiance) / _LOBE[:, None]


def variance_from_patches(variance: np.ndarray) -> np.ndarray:
    """The variance (p, 4, 3) of ``radiance_from_patches`` where that of the patches' irradiance is ``variance`` (p, 14, 3)."""
    basis = sh.evaluate(NORMALS, 1).astype(np.float64)
    return np.einsum("jk,pjc->pkc", (4.0 * np.pi * WEIGHTS[:, None] * basis) ** 2, variance) / _LOBE[:, None] ** 2
