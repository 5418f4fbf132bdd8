"""What transfer leaves out of media, and how much light that is: matrices of a medium would need columns of its own."""

import numpy as np

from ...numerics import grid as lattice
from ...scene import Medium, Omission, Scene
from ...scene.baked import baked_part

_CORNERS = np.array([[x, y, z, 1.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def media_left_out(scene: Scene) -> tuple[Omission, ...]:
    """An omission for each medium of ``scene`` that bakes know: by how much it dims what crosses it, or that it gives light."""
    scene = baked_part(scene)
    return tuple(Omission(_sentence(medium, _way_through(medium, scene)), objects=(medium.name,)) for medium in scene.media)


def _sentence(medium: Medium, way: float) -> str:
    density = 1.0 if medium.grid is None else float(medium.grid.density.mean())
    taken = 1.0 - np.exp(-float(np.mean(medium.extinction)) * density * way)
    what = f"transfer leaves medium {medium.name!r} out: it takes {100.0 * taken:.0f} % of the light that crosses all of it"
    return what + (", and gives light of its own" if np.any(np.asarray(medium.emission) > 0) else "")


def _way_through(medium: Medium, scene: Scene) -> float:
    """Half the diagonal [m] of what the medium fills, or of the largest volume of probes where it fills all space."""
    if medium.grid is not None:
        boxes = [_box_of(medium.grid.world_from_local)]
    elif medium.bounds is not None:
        boxes = [lattice.transform_points(medium.bounds.world_from_local, medium.bounds.vertices_local)]
    else:
        boxes = [_box_of(volume.world_from_local) for volume in scene.volumes]
    return max((0.5 * float(np.linalg.norm(np.ptp(points, axis=0))) for points in boxes), default=0.0)


def _box_of(world_from_local: np.ndarray) -> np.ndarray:
    return (_CORNERS @ np.asarray(world_from_local, np.float64).T)[:, :3]
