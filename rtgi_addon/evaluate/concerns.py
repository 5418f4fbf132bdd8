"""How much light what was not followed concerns: an estimate by paths from the probes.

Rays from usable probes to all sides carry what the path tracer says arrives along them. A surface concerns what comes straight
from it, reflected or emitted, or what would if it were as bright as all else, where nothing does: black is what a shader is taken
for that cannot be read. A lamp concerns what it would send to the probes by way of the surfaces that they see; something without a
surface (hair, a volume) what passes through its box. So the share of fog around the probes is 1 whatever its density, and light
that is changed further away than the first surface is not counted: the share says where to look first, not how wrong the bake
is. `rtgi verify` measures that.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.grid import lattice_points
from ..numerics.sampling import fibonacci_sphere, random_rotations
from ..scene import Omission, Scene
from ..techniques import Field
from ..transport.context import LightContext
from ..transport.paths.reference import trace_radiance
from ..transport.surfaces.geometry import Geometry
from ..transport.vectors import luminance

# Probes that look, at most, and the rays of all of them together.
PROBES, RAYS = 64, 1 << 14
ESTIMATED, MEASURED = "estimated", "measured"
# A share below the first is said to be less than that, one from the second on is said without digits after the point.
_LITTLE, _ALL = 0.001, 0.995


@dataclass(frozen=True)
class Concern:
    """An omission and the ``share`` (0 to 1) of the light at the probes that it concerns; None where nothing tells. ``how`` it is
    known: ESTIMATED, or MEASURED (then ``share`` is the relative difference that it makes, which may be more than 1)."""

    omission: Omission
    share: float | None
    how: str = ESTIMATED

    def to_json(self) -> dict:
        """The concern as JSON-able values."""
        return {"text": self.omission.text, "objects": list(self.omission.objects), "materials": list(self.omission.materials),
                "share": self.share, "how": self.how}

    def __str__(self) -> str:
        return f"{self.omission.text} ({self.extent})"

    @property
    def extent(self) -> str:
        """How much light it is, for a person."""
        if self.share is None:
            return "how much light that concerns is not known"
        amount = f"less than {100 * _LITTLE:g}" if self.share < _LITTLE else \
            f"{100 * self.share:.2g}" if self.share < _ALL else f"{100 * self.share:.0f}"
        if self.how == MEASURED:
            return f"makes a difference of {amount} %, measured"
        return f"concerns {amount} % of the light at the probes, {self.how}"


def concerns(context: LightContext, probes: np.ndarray, omissions: tuple[Omission, ...], seed: int = 0) -> tuple[Concern, ...]:
    """``omissions`` of the scene of ``context``, those of which nothing is known first, then those that concern most; ``probes``
    (n, 3) are where usable ones are."""
    points = _lookers(probes, seed)
    if not len(points):
        return tuple(Concern(omission, None) for omission in omissions)
    rays = fibonacci_sphere(RAYS // len(points))
    origins = np.repeat(points, len(rays), axis=0)
    turns = random_rotations(len(points), np.random.default_rng(seed))
    directions = np.einsum("pij,rj->pri", turns, rays).reshape(-1, 3).astype(np.float32)
    arriving = luminance(trace_radiance(context, origins, directions, seed=seed))
    hits = context.tracer.intersect(origins, directions)
    seen = _Seen(context, origins, directions, arriving, hits, seed)
    estimates = [Concern(omission, seen.share(omission)) for omission in omissions]
    return tuple(sorted(estimates, key=lambda concern: -1.0 if concern.share is None else -concern.share))


class _Seen:
    """What probes see: rays, what arrives along them and what they hit."""

    def __init__(self, context, origins, directions, arriving, hits, seed):
        self.context, self.seed = context, seed
        self.origins, self.directions, self.arriving, self.hits = origins, directions, arriving, hits
        self.total = float(arriving.sum(dtype=np.float64))

    def share(self, omission: Omission) -> float | None:
        """See Concern."""
        if self.total <= 0.0:
            return None
        scene, geometry = self.context.scene, self.context.geometry
        concerned = np.zeros(len(self.arriving), bool)
        known = omission.boxes_world is not None
        if known:
            concerned |= _through(omission.boxes_world, self.origins, self.directions, self.hits.t)
        triangles = _triangles(omission, scene, geometry)
        if triangles.any():
            known = True
            hit = self.hits.primitive >= 0
            concerned[hit] |= triangles[self.hits.primitive[hit]]
        lit, total = float(self.arriving[concerned].sum(dtype=np.float64)), self.total
        if triangles.any() and concerned.any() and not concerned.all() and not lit:
            lit = float(self.arriving[~concerned].mean(dtype=np.float64)) * np.count_nonzero(concerned)
            total += lit
        others = tuple(light for light in scene.lights if light.name not in omission.objects)
        if len(others) < len(scene.lights):
            known = True
            without = self.context.relit(replace(scene, lights=others))
            rest = luminance(trace_radiance(without, self.origins, self.directions, seed=self.seed))
            lit += float((self.arriving - rest)[~concerned].sum(dtype=np.float64))
        return min(max(lit / total, 0.0), 1.0) if known else None


def usable_probes(field: Field) -> np.ndarray:
    """(n, 3) world positions of the usable probes of ``field``."""
    usable = [(lattice_points(grid.volume.world_from_local, grid.volume.resolution) + grid.offset_world)[grid.usable]
              for grid in field.grids()]
    return np.concatenate([np.zeros((0, 3)), *usable])


def _lookers(probes: np.ndarray, seed: int) -> np.ndarray:
    """At most PROBES of ``probes``, float32."""
    points = np.asarray(probes, np.float32)
    if len(points) <= PROBES:
        return points
    return points[np.sort(np.random.default_rng(seed).choice(len(points), PROBES, replace=False))]


def _triangles(omission: Omission, scene: Scene, geometry: Geometry) -> np.ndarray:
    """(t,) bool: the triangles of the objects that are named, and those of the materials that are."""
    objects = np.array([instance.name in omission.objects for instance in scene.instances] or [False])
    materials = np.array([material.name in omission.materials for material in scene.materials] or [False])
    return objects[geometry.instance] | (materials[geometry.material] if scene.materials else False)


def _through(boxes: np.ndarray, origins: np.ndarray, directions: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """(n,) bool: rays that meet any of ``boxes`` (b, 2, 3) before ``reach`` (n,), or begin inside one."""
    result = np.zeros(len(origins), bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / directions
        for low, high in boxes:
            first, second = (low - origins) * inverse, (high - origins) * inverse
            entry = np.nanmax(np.minimum(first, second), axis=1)
            leave = np.nanmin(np.maximum(first, second), axis=1)
            result |= (entry <= leave) & (leave > 0.0) & (entry < reach)
    return result
