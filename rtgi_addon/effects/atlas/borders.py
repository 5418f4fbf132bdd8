"""What lies about islands: texels filled from their neighbours, and seams at which both sides are made to say the same.

Seams after M. Iwanicki, "Lighting Technology of The Last of Us", SIGGRAPH 2013: the least change of texels, in squares, for which
what is read on both sides of an edge agrees.
"""

import numpy as np

from ...scene import Scene
from .fit import LookUpMeans, fitted
from .sheet import corners_of
from .unwrapped import Part, Sheet, texture_space

# Normals of the two sides whose cosine is less belong to an edge that is meant to be seen.
SAME_NORMAL = 0.94
# Places along a seam for each texel that it crosses; what a texel's change costs against a difference, measured or filled in.
_PLACES_A_TEXEL, _MEASURED_COST, _FILLED_COST = 3.0, 0.03, 0.005
_STEPS, _ENOUGH = 200, 1e-5
# Channels that are worked on together, and numbers of them.
_CHANNELS, _AT_ONCE = 64, 1 << 26
_NEIGHBOURS = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1) if (row, column) != (0, 0)]


class Borders:
    """The islands of a ``sheet`` of objects in ``scene``: what is about them is filled, what is read between texels is made to be
    what was measured, and their seams are joined. All of it is linear in what texels hold."""

    def __init__(self, sheet: Sheet, scene: Scene):
        self.sheet, self.size = sheet, sheet.size
        sides = [seams_of(part, scene) for part in sheet.parts]
        self._seams = [np.concatenate([side[number] for side in sides]) for number in (0, 1)]

    def closed(self, texels: np.ndarray, known: np.ndarray, values: np.ndarray,
               covered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The image (height, width, c) float32 of ``values`` (n, c) at ``texels`` (n,) of which those that are ``known`` (n,) bool
        count, measured at places that are ``covered`` (n, FINENESS²) bool, and which texels these are (height, width) bool."""
        height, width = self.size
        image, found = np.zeros((height * width, values.shape[1]), np.float32), np.zeros(height * width, bool)
        image[texels], found[texels] = values, known
        image, found = image.reshape(height, width, -1), found.reshape(height, width)
        means, together = LookUpMeans(self.size, texels[known], covered[known]), max(min(_AT_ONCE // found.size, _CHANNELS), 1)
        for part in range(0, image.shape[2], together):
            channels = slice(part, part + together)
            filled, _ = dilated(image[..., channels], found, self.sheet)
            image[..., channels] = joined(fitted(filled, means, found), found, *self._seams)
        return image, found


def dilated(image: np.ndarray, known: np.ndarray, sheet: Sheet) -> tuple[np.ndarray, np.ndarray]:
    """``image`` (height, width, c) with texels that are not ``known`` (height, width) bool filled from those about them, outward
    until each part's rectangle is full, and which have a value now."""
    image, filled = image.copy(), known.copy()
    for part in sheet.parts:
        rows = slice(part.y, part.y + part.height), slice(part.x, part.x + part.width)
        image[rows], filled[rows] = _spread(image[rows], filled[rows])
    return image, filled


def _spread(image: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    height, width = known.shape
    while known.any() and not known.all():
        values = np.pad(np.where(known[..., None], image, 0.0), ((1, 1), (1, 1), (0, 0)))
        counts = np.pad(known.astype(np.float32), 1)
        parts = [(slice(1 + row, 1 + row + height), slice(1 + column, 1 + column + width)) for row, column in _NEIGHBOURS]
        # Neighbours across a corner are farther away.
        weights = [1.0 if 0 in place else 0.5 for place in _NEIGHBOURS]
        total = sum(weight * values[part] for weight, part in zip(weights, parts, strict=True))
        count = sum(weight * counts[part] for weight, part in zip(weights, parts, strict=True))
        new = ~known & (count > 0)
        image = np.where(new[..., None], total / np.maximum(count, 1e-6)[..., None], image).astype(image.dtype)
        known = known | new
    return image, known


def seams_of(part: Part, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Places (s, 2) on the sheet [texels] along edges where the map of ``part`` is cut and the surface is not, and those (s, 2)
    on the other side."""
    mesh = scene.meshes[scene.instances[part.instance].mesh]
    place = texture_space(mesh.uv_layers[part.uv_map]) * part.scale + part.offset
    normals = _corner_normals(mesh)
    triangle, corner = np.repeat(np.arange(len(mesh.triangles)), 3), np.tile(np.arange(3), len(mesh.triangles))
    following = (corner + 1) % 3
    # Vertices at the same place are the same, cut or not.
    _, same = np.unique(mesh.vertices_local, axis=0, return_inverse=True)
    ends = same.reshape(-1)[np.stack([mesh.triangles[triangle, corner], mesh.triangles[triangle, following]], axis=1)]
    forward = ends[:, 0] <= ends[:, 1]
    first, second = np.where(forward, corner, following), np.where(forward, following, corner)
    _, edge, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    order = np.argsort(edge, kind="stable")
    order = order[count[edge[order]] == 2].reshape(-1, 2)
    a, b = order.T
    here, there = (np.stack([place[triangle[side], first[side]], place[triangle[side], second[side]]], axis=1) for side in (a, b))
    facing = np.min([np.sum(normals[triangle[a], end[a]] * normals[triangle[b], end[b]], axis=1) for end in (first, second)],
                    axis=0)
    length = np.maximum(*(np.linalg.norm(side[:, 1] - side[:, 0], axis=1) for side in (here, there)))
    cut = (np.abs(here - there).max(axis=(1, 2)) > 1e-3) & (facing >= SAME_NORMAL) & (length > 1e-6)
    here, there = here[cut], there[cut]
    number = np.ceil(length[cut] * _PLACES_A_TEXEL).astype(np.int64) + 1
    row = np.repeat(np.arange(len(number)), number)
    along = ((np.arange(len(row)) - np.repeat(np.cumsum(number) - number, number)) / np.maximum(number[row] - 1, 1))[:, None]
    return tuple(side[row, 0] * (1.0 - along) + side[row, 1] * along for side in (here, there))


def _corner_normals(mesh) -> np.ndarray:
    if mesh.corner_normals_local is not None:
        return mesh.corner_normals_local.astype(np.float64)
    corners = mesh.vertices_local[mesh.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    return np.repeat(normals[:, None], 3, axis=1)


def joined(image: np.ndarray, known: np.ndarray, here: np.ndarray, there: np.ndarray) -> np.ndarray:
    """``image`` (height, width, c), of which texels that are ``known`` (height, width) were measured, changed by the least for
    which what is read at ``here`` and at ``there`` (s, 2) agrees."""
    if not len(here):
        return image
    size = image.shape[:2]
    (index_a, weight_a), (index_b, weight_b) = corners_of(here, size), corners_of(there, size)
    texels, local = np.unique(np.concatenate([index_a, index_b], axis=1), return_inverse=True)
    local, weight = local.reshape(len(here), 8), np.concatenate([weight_a, -weight_b], axis=1)
    flat = image.reshape(size[0] * size[1], -1)
    start = flat[texels].astype(np.float64)
    cost = np.where(known.reshape(-1)[texels], _MEASURED_COST, _FILLED_COST)[:, None]

    def apart(values: np.ndarray) -> np.ndarray:
        return np.einsum("si,sic->sc", weight, values[local])

    order = np.argsort(local.reshape(-1), kind="stable")
    first = np.searchsorted(local.reshape(-1)[order], np.arange(len(texels)))

    def back(differences: np.ndarray) -> np.ndarray:
        spread = (weight[:, :, None] * differences[:, None]).reshape(-1, differences.shape[1])
        return np.add.reduceat(spread[order], first, axis=0)

    # Conjugate gradients of (BᵀB + cost)·x = −Bᵀ·B·start for the change x, of all channels at once.
    change, rest = np.zeros_like(start), -back(apart(start))
    along, power = rest.copy(), np.sum(rest**2, axis=0)
    enough = _ENOUGH**2 * np.maximum(power, 1e-30)
    for _ in range(_STEPS):
        if np.all(power <= enough):
            break
        moved = back(apart(along)) + cost * along
        step = power / np.maximum(np.sum(along * moved, axis=0), 1e-30)
        change += step * along
        rest -= step * moved
        following = np.sum(rest**2, axis=0)
        along, power = rest + following / np.maximum(power, 1e-30) * along, following
    result = flat.copy()
    result[texels] = start + change
    return result.reshape(image.shape).astype(image.dtype)
