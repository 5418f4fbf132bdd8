"""Objects' UV maps as rectangles of one sheet of texels: how large, where, and which texel shows which point of which triangle.

Coordinates of textures, ``st``, are UV with v turned down: (u, 1 − v), as glTF has them; a place on the sheet is in texels, with
row 0 on top and the middle of texel i at i + ½.
"""

from dataclasses import dataclass

import numpy as np

from ...errors import BakeError
from ...scene import Mesh, Scene
from ...transport.surfaces.geometry import Geometry
from .settings import AtlasSettings

# The UV map that lightmaps are looked for in where none is named.
USUAL = "Lightmap"
# Places along a side of a texel that are looked at.
FINENESS = 4
# A map is refused that overlaps on this share of what it covers; one where this share of the surface has no area in it.
MOST_OVERLAP, MOST_FLAT = 0.002, 0.01
# Triangles' own edges are no overlap: places so near one, in barycentric coordinates, do not count.
_EDGE = 1e-3
# Candidates that are tested at a time, and sizes are multiples of these many texels.
_AT_ONCE, _STEP = 1 << 21, 4


@dataclass(frozen=True, eq=False)
class Part:
    """One object on the sheet: its ``name`` and ``instance`` in the bake's scene, its UV map ``uv_map``, the ``texcoord``-th of the
    mesh; the sheet's texel rectangle ``x``, ``y``, ``width``, ``height``; places on the sheet [texels] are st·``scale`` +
    ``offset`` (2,)."""

    name: str
    instance: int
    uv_map: str
    texcoord: int
    x: int
    y: int
    width: int
    height: int
    scale: float
    offset: np.ndarray


@dataclass(frozen=True, eq=False)
class Sheet:
    """The ``parts`` on a sheet of ``size`` (height, width) texels."""

    parts: tuple[Part, ...]
    size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Places:
    """Where texels of one part lie on its triangles: ``texel`` (s,) int64 on the sheet (row·width + column), ascending, and for
    each of these places which of its texel's FINENESS² it is, ``step`` (s,) uint8, row by row, and the world's ``triangle`` (s,)
    int32 with Embree's ``u`` and ``v`` (s,) float32."""

    texel: np.ndarray
    step: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray


def uv_map_of(mesh: Mesh, name: str, wanted: str) -> str:
    """The UV map of ``mesh``, of the object called ``name``, that is ``wanted`` ("": USUAL, else the one for renders). Raises
    BakeError where there is none."""
    if not mesh.uv_layers:
        raise BakeError(f"{name} has no UV map for the light atlas", "unwrap it (UV > Lightmap Pack), or take it out of the atlas")
    if wanted and wanted not in mesh.uv_layers:
        raise BakeError(f"{name} has no UV map {wanted!r}", f"choose one of {', '.join(mesh.uv_layers)}")
    return wanted or (USUAL if USUAL in mesh.uv_layers else mesh.active_uv or next(iter(mesh.uv_layers)))


def lay_out(scene: Scene, geometry: Geometry, settings: AtlasSettings) -> Sheet:
    """The sheet of all instances of ``scene`` that are to be in the atlas. Raises BakeError, with the object's name, for one that
    cannot be."""
    chosen, found = [index for index, instance in enumerate(scene.instances) if instance.atlas is not None], []
    names = [scene.instances[index].name for index in chosen]
    for index, name in zip(chosen, names, strict=True):
        instance = scene.instances[index]
        mesh = scene.meshes[instance.mesh]
        if names.count(name) > 1:
            raise BakeError(f"{name} is placed {names.count(name)} times, and the light atlas has room for one of a name",
                            "make its instances real (Object > Apply > Make Instances Real), or take it out of the atlas")
        uv_map = uv_map_of(mesh, name, instance.atlas)
        st = texture_space(mesh.uv_layers[uv_map])
        areas = geometry.areas[geometry.instance == index].astype(np.float64)
        scale = settings.density * np.sqrt(_checked_area(name, uv_map, st, areas))
        low, high = st.reshape(-1, 2).min(axis=0), st.reshape(-1, 2).max(axis=0)
        width, height = (int(side) for side in np.ceil((high - low) * scale) + 2 * settings.margin)
        found.append((index, name, uv_map, list(mesh.uv_layers).index(uv_map), width, height, scale, low))
    corners, size = _packed([(entry[4], entry[5]) for entry in found])
    if max(size) > settings.largest:
        index = int(np.argmax([entry[4] * entry[5] for entry in found]))
        raise BakeError(f"the light atlas takes {size[1]} x {size[0]} texels, {found[index][4]} x {found[index][5]} of them for "
                        f"{found[index][1]}, and {settings.largest} along a side is the most",
                        "lower its Density (--set atlas.density), or raise its Largest Side (--set atlas.largest)")
    return Sheet(tuple(
        Part(name, index, uv_map, texcoord, x, y, width, height, float(scale), np.array([x, y]) + settings.margin - low * scale)
        for (index, name, uv_map, texcoord, width, height, scale, low), (x, y) in zip(found, corners, strict=True)), size)


def texture_space(uv: np.ndarray) -> np.ndarray:
    """(…, 2) float64 of a UV map's corners (…, 2)."""
    return np.stack([uv[..., 0], 1.0 - uv[..., 1].astype(np.float64)], axis=-1).astype(np.float64)


def _checked_area(name: str, uv_map: str, st: np.ndarray, areas: np.ndarray) -> float:
    """The surface [m²] that a unit of area of the map stands for. Raises BakeError for a map that is not unwrapped."""
    if not np.isfinite(st).all():
        raise BakeError(f"UV map {uv_map!r} of {name} holds values that are not finite", "unwrap it anew")
    first, second = st[:, 1] - st[:, 0], st[:, 2] - st[:, 0]
    covered = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    flat = areas[covered <= 1e-9 * max(covered.max(initial=0.0), 1e-30)].sum()
    if covered.sum() <= 0 or flat > MOST_FLAT * areas.sum():
        raise BakeError(f"UV map {uv_map!r} of {name} gives no area to {100 * flat / max(areas.sum(), 1e-30):.0f} % of its surface",
                        "unwrap it anew (UV > Lightmap Pack)")
    return float(areas.sum() / covered.sum())


def _packed(sizes: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Where rectangles of ``sizes`` (width, height) go, and the (height, width) of the sheet: shelves, the highest first, on a
    sheet about as wide as high."""
    total = sum(width * height for width, height in sizes)
    side = max(max((width for width, _ in sizes), default=1), int(np.ceil(np.sqrt(total))))
    width = -(-side // _STEP) * _STEP
    corners, x, y, shelf = [(0, 0)] * len(sizes), 0, 0, 0
    for index in sorted(range(len(sizes)), key=lambda number: (-sizes[number][1], -sizes[number][0], number)):
        if x + sizes[index][0] > width:
            x, y, shelf = 0, y + shelf, 0
        corners[index] = x, y
        x, shelf = x + sizes[index][0], max(shelf, sizes[index][1])
    return corners, (max(-(-(y + shelf) // _STEP) * _STEP, _STEP), width)


def places_of(part: Part, sheet: Sheet, scene: Scene, geometry: Geometry) -> Places:
    """The places of the texels of ``part``, FINENESS² a texel at most. Raises BakeError for a map that overlaps itself."""
    mesh = scene.meshes[scene.instances[part.instance].mesh]
    first = int(np.flatnonzero(geometry.instance == part.instance)[0])
    corners = (texture_space(mesh.uv_layers[part.uv_map]) * part.scale + part.offset - (part.x, part.y)) * FINENESS
    wide, high = part.width * FINENESS, part.height * FINENESS
    owner, covered = np.full(wide * high, -1, np.int32), np.zeros(wide * high, np.uint16)
    uv = np.zeros((wide * high, 2), np.float32)
    low = np.clip(np.floor(corners.min(axis=1) - 0.5), 0, (wide - 1, high - 1)).astype(np.int64)
    count = np.clip(np.ceil(corners.max(axis=1) + 0.5), 0, (wide, high)).astype(np.int64) - low
    edges = corners[:, 1:] - corners[:, :1]
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    candidates = np.where(np.abs(area) > 1e-12, np.maximum(count, 0).prod(axis=1), 0)
    ends = np.cumsum(candidates)
    start = 0
    while start < len(candidates):
        stop = max(int(np.searchsorted(ends, (ends[start - 1] if start else 0) + _AT_ONCE, side="right")), start + 1)
        triangle = np.repeat(np.arange(start, stop), candidates[start:stop])
        number = np.arange(len(triangle)) - np.repeat(ends[start:stop] - candidates[start:stop] - (ends[start - 1] if start else 0),
                                                      candidates[start:stop])
        place = low[triangle] + np.stack([number % np.maximum(count[triangle, 0], 1), number // np.maximum(count[triangle, 0], 1)],
                                         axis=1)
        off = place + 0.5 - corners[triangle, 0]
        u = (off[:, 0] * edges[triangle, 1, 1] - off[:, 1] * edges[triangle, 1, 0]) / area[triangle]
        v = (edges[triangle, 0, 0] * off[:, 1] - edges[triangle, 0, 1] * off[:, 0]) / area[triangle]
        nearest = np.minimum(np.minimum(u, v), 1.0 - u - v)
        inside = nearest >= -1e-6
        flat = place[inside, 1] * wide + place[inside, 0]
        np.add.at(covered, flat[nearest[inside] > _EDGE], 1)
        owner[flat] = triangle[inside]
        uv[flat] = np.stack([u[inside], v[inside]], axis=1)
        start = stop
    found = np.flatnonzero(owner >= 0)
    overlap = np.count_nonzero(covered > 1) / max(len(found), 1)
    if overlap > MOST_OVERLAP:
        raise BakeError(f"UV map {part.uv_map!r} of {part.name} overlaps itself on {100 * overlap:.1f} % of what it covers",
                        "unwrap it so that no two faces share a place (UV > Lightmap Pack), or name another map")
    row, column = part.y + found // wide // FINENESS, part.x + found % wide // FINENESS
    texel = row * sheet.size[1] + column
    order = np.argsort(texel, kind="stable")
    kept = found[order]
    step = (kept // wide % FINENESS * FINENESS + kept % wide % FINENESS).astype(np.uint8)
    return Places(texel[order], step, (first + owner[kept]).astype(np.int32), *np.clip(uv[kept].T, 0.0, 1.0))
