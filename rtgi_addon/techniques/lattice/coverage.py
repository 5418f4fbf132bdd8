"""Whether probe volumes lie where light is to be known: how many of their probes are in the open, and how much of the scene they
leave out. What a bake refuses or warns of, and what a check of the scene says before one."""

from dataclasses import replace

import numpy as np

from ...errors import BakeError
from ...numerics.blocks import blocks, cross
from ...numerics.grid import transform_points
from ...progress import Progress
from ...scene import ProbeVolume, Scene
from ...scene.checks import Finding, scene_bounds
from ...transport.context import LightContext
from .fit import fit_volume, worth_filling
from .placement import place

# A volume with a smaller share of usable probes, and volumes that hold a smaller share of the scene's surfaces, are warned of.
MOST_OF = 0.5
# Points on surfaces that are looked at, and the random numbers that choose them.
_POINTS, _SEED = 4096, 0x636F76
# How far outside a volume a surface may be and still be lit by its outermost probes [cells]: walls lie in the very side of its box.
_NEAR = 1.0


def _buried(name: str) -> BakeError:
    return BakeError(f"every probe of the volume {name!r} lies inside geometry",
                     "move or resize it so that it covers open space, or fit it to the scene")


class NoUsableProbe(BakeError):
    """All probes of ``volume`` (its name) are inside of something, and hold nothing."""

    def __init__(self, volume: str):
        told = _buried(volume)
        super().__init__(told.cause, told.remedy)
        self.volume = volume

    def __reduce__(self):
        return type(self), (self.volume,)


def require_open(volumes: tuple[ProbeVolume, ...], measured: np.ndarray) -> None:
    """Raise NoUsableProbe for the first of ``volumes`` of whose probes none is ``measured`` (p,), volume after volume."""
    for volume, count, usable in _counted(volumes, measured):
        if count and not usable:
            raise NoUsableProbe(volume.name)


def require_usable(scene: Scene, threads: int | None = None) -> None:
    """Raise NoUsableProbe if a volume of ``scene`` has no probe in the open: a bake may fit one in its place, what measures volumes
    has nothing to measure."""
    placement = place(LightContext(scene, threads), scene.volumes, True, Progress())
    require_open(scene.volumes, placement.measured)


def placement_findings(context: LightContext, progress: Progress | None = None) -> list[Finding]:
    """What placing the probes of the scene of ``context`` shows: volumes without a usable probe, which a bake
    refuses or replaces (``fitted_in_place``), and those most of whose probes are inside of something."""
    volumes = context.scene.volumes
    placement = place(context, volumes, True, progress or Progress())
    found = []
    for volume, count, usable in _counted(volumes, placement.measured):
        if count and not usable:
            refused = NoUsableProbe(volume.name)
            fitted = fitted_in_place(context.scene, refused)
            found.append(fitted[1] if fitted else Finding("error", "", refused.cause, refused.remedy, (volume.name,)))
        elif usable < MOST_OF * count and volume.near is None:
            found.append(mostly_inside(volume.name, usable / count))
    return found


def mostly_inside(name: str, usable: float) -> Finding:
    """The warning of the volume ``name`` of whose probes only the share ``usable`` lies in the open."""
    return Finding("warning", f"volume {name}", f"has {100.0 * (1.0 - usable):.0f} % of its probes inside geometry",
                   "they take their light from the others: move or resize it so that it covers open space", (name,))


def coverage_findings(scene: Scene, volumes: tuple[ProbeVolume, ...]) -> list[Finding]:
    """A warning where more than half of the surfaces of ``scene`` lie outside all of ``volumes``, beside those that lie entirely
    outside the scene. Ground planes and sky domes count as far as a fitted volume would follow them (``fit_bounds``)."""
    if not volumes or scene_bounds(scene) is None or any(volume.fitted for volume in volumes):
        return []
    low, high = worth_filling(scene)
    # One that reaches far beyond the bounds must not take all points.
    points = surface_points(scene, _POINTS, 2.0 * float(np.sum((high - low) * np.roll(high - low, 1))))
    points = points[np.all((points >= low - 1e-6) & (points <= high + 1e-6), axis=1)]
    if not len(points):
        return []
    inside = np.zeros(len(points), bool)
    for volume in volumes:
        with np.errstate(all="ignore"):
            try:
                local = transform_points(np.linalg.inv(np.asarray(volume.world_from_local, np.float64)), points)
            except np.linalg.LinAlgError:  # scaled to nothing: said elsewhere
                return []
        inside |= np.all(np.abs(local) <= 1.0 + _NEAR * 2.0 / np.asarray(volume.resolution), axis=1)
    outside = 1.0 - float(inside.mean())
    if outside <= MOST_OF:
        return []
    names = tuple(volume.name for volume in volumes)
    return [Finding("warning", f"scene {scene.name}", f"has {100.0 * outside:.0f} % of its surfaces outside every probe volume",
                    "they are lit by the nearest probes, or by none: resize the volumes, or fit one to the scene", names)]


def fitted_in_place(scene: Scene, refused: NoUsableProbe) -> tuple[Scene, Finding] | None:
    """``scene`` with a fitted volume in the place of its only one, in which there is no usable probe, and what to say about that;
    None where there are others to choose from, or the volume was fitted already."""
    if len(scene.volumes) != 1 or scene.volumes[0].fitted or scene.volumes[0].wanted is not None or scene.volumes[0].planned:
        return None
    volume, fitted = scene.volumes[0], fit_volume(scene)
    placed = replace(volume, world_from_local=fitted.world_from_local, resolution=fitted.resolution, fitted=True)
    size = 2.0 * np.diag(placed.world_from_local)[:3]
    nx, ny, nz = placed.resolution
    told = Finding("warning", "", refused.cause,
                   f"one of {size[0]:.3g} × {size[1]:.3g} × {size[2]:.3g} m with {nx} × {ny} × {nz} = {nx * ny * nz} probes was "
                   "baked in its place; fit the volume to the scene to keep that", (volume.name,))
    return replace(scene, volumes=(placed,)), told


def surface_points(scene: Scene, count: int, most_area: float = np.inf) -> np.ndarray:
    """About ``count`` points (n, 3) float64 on the surfaces of ``scene``, evenly by area (nearly, where an instance is scaled
    unevenly), of which an instance counts with at most ``most_area`` [m²]. Always the same ones, and none that are not finite."""
    rng = np.random.default_rng(_SEED)
    areas = [_areas(mesh) for mesh in scene.meshes]
    sizes = np.array([areas[instance.mesh].sum() * _scale(instance) for instance in scene.instances])
    sizes = np.minimum(np.where(np.isfinite(sizes), sizes, 0.0), most_area)
    if not sizes.sum() > 0.0:
        return np.zeros((0, 3))
    shares = rng.multinomial(count, sizes / sizes.sum())
    points = []
    for instance, wanted in zip(scene.instances, shares, strict=True):
        if wanted:
            mesh = scene.meshes[instance.mesh]
            area = np.nan_to_num(areas[instance.mesh])
            chosen = rng.choice(len(area), wanted, p=area / area.sum())
            corners = mesh.vertices_local[mesh.triangles[chosen]].astype(np.float64)
            u, v = rng.random((2, wanted))
            root = np.sqrt(u)
            weights = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)
            points.append(transform_points(instance.world_from_local, np.einsum("nc,ncx->nx", weights, corners)))
    points = np.concatenate(points)
    return points[np.isfinite(points).all(axis=1)]


def _areas(mesh) -> np.ndarray:
    if not len(mesh.triangles) or mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices_local):
        return np.zeros(0)
    areas = np.empty(len(mesh.triangles))
    with np.errstate(all="ignore"):
        for rows in blocks(len(areas)):
            corners = mesh.vertices_local[mesh.triangles[rows]].astype(np.float64)
            areas[rows] = 0.5 * np.linalg.norm(cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return areas


def _scale(instance) -> float:
    """By how much an instance multiplies areas, on average over directions."""
    return float(np.abs(np.linalg.det(np.asarray(instance.world_from_local, np.float64)[:3, :3])) ** (2.0 / 3.0))


def _counted(volumes, measured):
    """Each volume with the number of its probes that are wanted, and of those that are ``measured``."""
    start = 0
    for volume in volumes:
        stop = start + int(np.prod(volume.resolution))
        yield volume, stop - start, int(np.count_nonzero(measured[start:stop]))
        start = stop
