"""Where surfaces that are seen read a light atlas: the triangles of a scene whose objects are in it, and for any point of one the
place on the sheet. The tables are those of the preview's shader too (shaders/indirect_atlas.comp.glsl)."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary, ref

import numpy as np

from ...scene import Scene
from ...transport.vectors import dot, normalized
from .sheet import LightAtlas
from .unwrapped import Part, texture_space

# The tables of scenes that are being drawn, by the atlas.
_KNOWN: WeakKeyDictionary = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class AtlasSurfaces:
    """The triangles of a scene that read an atlas, by instances: ``rows`` (i,) int64 is where those of each begin in the tables, −1
    for one without, ``first`` (i,) int64 the number of its first triangle in the scene. ``across`` and ``down`` (t, 4) float32 take
    a point (x, y, z, 1) of the triangle [m, world] to its place on the sheet [texels]; ``front`` (t, 3) float32 are unit normals,
    world, of the side that is lit."""

    rows: np.ndarray
    first: np.ndarray
    across: np.ndarray
    down: np.ndarray
    front: np.ndarray

    def find(self, primitive: np.ndarray, instance: np.ndarray, points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, ...]:
        """Which of ``points`` (n, 3) on the triangles ``primitive`` (n,) of ``instance`` (n,), seen from where ``faces`` (n, 3)
        look, read the atlas, as indices (m,), and their places on the sheet (m, 2) float64."""
        chosen = np.flatnonzero(self.rows[instance] >= 0)
        row = self.rows[instance[chosen]] + primitive[chosen] - self.first[instance[chosen]]
        lit = dot(self.front[row], faces[chosen]) > 0
        chosen, row = chosen[lit], row[lit]
        places = [dot(table[row], points[chosen]) + table[row, 3] for table in (self.across, self.down)]
        return chosen, np.stack(places, axis=1).astype(np.float64)


def surfaces_in(scene: Scene, atlas: LightAtlas) -> AtlasSurfaces | None:
    """What of ``scene`` reads ``atlas``, by the names of its objects and UV maps; None for nothing. Asked for again as long as both
    are about, the same."""
    known = _KNOWN.get(atlas)
    if known is None or known[0]() is not scene:
        known = _KNOWN[atlas] = ref(scene), _surfaces_in(scene, atlas)
    return known[1]


def _surfaces_in(scene: Scene, atlas: LightAtlas) -> AtlasSurfaces | None:
    counts = [len(scene.meshes[instance.mesh].triangles) for instance in scene.instances]
    first, rows = np.cumsum([0, *counts])[:-1].astype(np.int64), np.full(len(counts), -1, np.int64)
    names, found = [instance.name for instance in scene.instances], []
    for part in atlas.sheet.parts:
        if names.count(part.name) != 1:
            continue
        index = names.index(part.name)
        mesh = scene.meshes[scene.instances[index].mesh]
        if part.uv_map in mesh.uv_layers and counts[index]:
            rows[index] = sum(len(entry[0]) for entry in found)
            found.append(_rows(mesh, np.asarray(scene.instances[index].world_from_local, np.float64), part))
    if not found:
        return None
    return AtlasSurfaces(rows, first, *(np.concatenate(arrays) for arrays in zip(*found, strict=True)))


def _rows(mesh, world_from_local: np.ndarray, part: Part) -> tuple[np.ndarray, ...]:
    """``across``, ``down`` and ``front`` of the triangles of one object: the affine maps of points to the sheet that change along
    the triangle alone."""
    corners = mesh.vertices_local.astype(np.float64)[mesh.triangles] @ world_from_local[:3, :3].T + world_from_local[:3, 3]
    places = texture_space(mesh.uv_layers[part.uv_map]) * part.scale + part.offset
    edges, steps = corners[:, 1:] - corners[:, :1], places[:, 1:] - places[:, :1]
    # Gradients g of a coordinate with g·e = its step along both edges e, within their plane: Eᵀ (E Eᵀ)⁻¹ step.
    a, b, c = dot(edges[:, 0], edges[:, 0]), dot(edges[:, 0], edges[:, 1]), dot(edges[:, 1], edges[:, 1])
    area = a * c - b * b
    scale = np.divide(1.0, area, out=np.zeros_like(area), where=area > 1e-12 * a * c)[:, None]
    shares = np.stack([(c[:, None] * steps[:, 0] - b[:, None] * steps[:, 1]) * scale,
                       (a[:, None] * steps[:, 1] - b[:, None] * steps[:, 0]) * scale], axis=1)
    gradients = np.einsum("tex,tec->tcx", edges, shares)
    offsets = places[:, 0] - np.einsum("tcx,tx->tc", gradients, corners[:, 0])
    maps = np.concatenate([gradients, offsets[:, :, None]], axis=2).astype(np.float32)
    mirrored = np.linalg.det(world_from_local[:3, :3]) < 0
    front = normalized(np.cross(edges[:, 0], edges[:, 1])) * (-1.0 if mirrored else 1.0)
    return maps[:, 0], maps[:, 1], front.astype(np.float32)
