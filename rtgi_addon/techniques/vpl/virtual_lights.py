"""Virtual lights: points on surfaces that shine like a diffuse patch, and directions that stand for a part of the world."""

from dataclasses import dataclass, field, fields, replace

import numpy as np


def _empty(*shape) -> np.ndarray:
    return np.zeros(shape, np.float32)


@dataclass(frozen=True, eq=False)
class VirtualLights:
    """n virtual point lights (VPLs) and m distant lights, as a structure of arrays; float32 unless said otherwise.

    A VPL at ``positions`` (n, 3) has radiant intensity ``flux``/π·cosθ about its unit ``normals`` (n, 3): ``flux`` (n, 3) [W] is
    what it sends out, albedo included. So E = Σ flux/π · cosθ·cosθ′/r² · V at a receiver. Positions lie off their surface by
    what a float ray needs, to the side of the normal. ``source`` (n,) int32 is the lamp's index, −1 for emissive surfaces, −2
    for the world; ``bounce`` (n,) int8 counts reflections: 0 is an emissive surface itself. ``path`` (n,) int32 tells which
    light path deposited it. A distant light arrives from ``directions`` (m, 3) unit with ``irradiance`` (m, 3) [W·m⁻²] on a
    facing plane.
    """

    positions: np.ndarray
    normals: np.ndarray
    flux: np.ndarray
    source: np.ndarray
    bounce: np.ndarray
    path: np.ndarray
    directions: np.ndarray = field(default_factory=lambda: _empty(0, 3))
    irradiance: np.ndarray = field(default_factory=lambda: _empty(0, 3))

    @staticmethod
    def of(positions: np.ndarray, normals: np.ndarray, flux: np.ndarray, source: int = 0, bounce: int = 1) -> "VirtualLights":
        """VPLs from bare arrays, such as the texels of a reflective shadow map; each counts as a path of its own."""
        n = len(positions)
        return VirtualLights(np.asarray(positions, np.float32), np.asarray(normals, np.float32), np.asarray(flux, np.float32),
                             np.full(n, source, np.int32), np.full(n, bounce, np.int8), np.arange(n, dtype=np.int32))

    @property
    def count(self) -> int:
        """Number of VPLs on surfaces."""
        return len(self.positions)

    @property
    def distant_count(self) -> int:
        """Number of distant lights."""
        return len(self.directions)

    def take(self, rows) -> "VirtualLights":
        """Some of the VPLs, with all distant lights."""
        return replace(self, **{name: getattr(self, name)[rows] for name in _POINT_ARRAYS})

    def with_distant(self, directions: np.ndarray, irradiance: np.ndarray) -> "VirtualLights":
        """The same VPLs with these distant lights."""
        return replace(self, directions=np.asarray(directions, np.float32), irradiance=np.asarray(irradiance, np.float32))

    def arrays(self) -> dict[str, np.ndarray]:
        """Every array by name."""
        return {item.name: getattr(self, item.name) for item in fields(self)}


_POINT_ARRAYS = ("positions", "normals", "flux", "source", "bounce", "path")


def concatenate(parts: list[VirtualLights]) -> VirtualLights:
    """All VPLs and distant lights of ``parts``, in order; ``path`` counts on from part to part. Raises ValueError for none."""
    if not parts:
        raise ValueError("nothing to concatenate")
    start, paths = 0, []
    for part in parts:
        paths.append(part.path + start)
        start += int(part.path.max()) + 1 if part.count else 0
    arrays = {item.name: np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(VirtualLights)}
    return VirtualLights(**{**arrays, "path": np.concatenate(paths).astype(np.int32)})
