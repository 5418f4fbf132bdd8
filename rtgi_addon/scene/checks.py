"""The pre-flight: trouble that can be seen in a scene before any ray is shot, with the object it is in and what to do.

An error would make the bake wrong or fail; a warning says what the bake will do instead of what was drawn. Whether a volume lies
entirely inside a solid takes rays, so the technique reports that; how a file was read (missing images, materials baked through
Cycles) is in ``Scene.notes``.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import BakeError
from ..machine.memory import available_bytes
from ..numerics.blocks import blocks, cross, extent
from ..numerics.grid import UNIT_BOX
from .lights import AreaLight
from .material import Channel
from .memory import estimate_bytes, shortage
from .scene import Scene
from .sphere_probe import MOST_SPHERES

# What counts as no more than white: a layer's share and what it leaves of the base are rounded apart, and may add up to 1 + 1e-7.
WHITE = 1.0 + 1e-4
# Heights below this share of the longest edge are float32 rounding, not a triangle.
DEGENERATE = 1e-7
# Ratio of the smallest to the largest axis below which a matrix flattens what it moves.
SINGULAR = 1e-7
# float32 resolves 6e-8 of a coordinate: at this many scene sizes from the origin, offsets against self-intersection show.
FAR_IN_SCENE_SIZES = 1000.0
SMALLEST_SCENE, LARGEST_SCENE = 1e-3, 1e6  # metres
# How far around the geometry, as a share of its diagonal, a volume still counts as in the scene.
NEAR = 0.25
BROKEN_TRANSFORM = ("has NaN or infinity in its transform", "clear its location, rotation or scale")


@dataclass(frozen=True)
class Finding:
    """One thing found: ``severity`` is 'error' or 'warning', ``object`` names where it is (an object, material, light or volume;
    "" where ``message`` does), ``message`` says what is wrong and ``remedy`` what to do. ``objects`` are the names of what it is
    about where ``object`` is not one."""

    severity: str
    object: str
    message: str
    remedy: str
    objects: tuple[str, ...] = ()

    @property
    def subject(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of the objects (lamps and volumes too) and of the materials that it is about."""
        if self.objects:
            return self.objects, ()
        whole = self.object.partition(" (and ")[0]
        kind, _, name = whole.partition(" ")
        if kind == "material":
            return (), (name,)
        return ((name, whole) if kind in {"light", "volume"} else (whole,)), ()

    @property
    def cause(self) -> str:
        """What is wrong and where, as BakeError has it."""
        return f"{self.object}: {self.message}" if self.object else self.message

    def __str__(self) -> str:
        return f"{self.cause}: {self.remedy}"


def check_scene(scene: Scene, *, sh_order: int = 2, memory_bytes: int | None = None) -> list[Finding]:
    """Everything found in ``scene``, errors first. ``memory_bytes`` is what a bake may use (None: what the machine has left)."""
    findings = [*_check_omissions(scene), *_check_meshes(scene), *_check_instances(scene), *_check_materials(scene),
                *_check_media(scene), *_check_lights(scene), *_check_volumes(scene), *_check_spheres(scene),
                *_check_memory(scene, sh_order, memory_bytes)]
    return sorted(findings, key=lambda finding: finding.severity != "error")


def require(findings: Iterable[Finding]) -> None:
    """Raise BakeError with the first error among ``findings``; the others are counted."""
    errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise BakeError(f"{errors[0].cause}{more}", errors[0].remedy)


def _check_omissions(scene: Scene):
    """What must be there before the light can be known."""
    for omission in scene.omissions:
        if omission.remedy:
            yield Finding("error", "", omission.text, omission.remedy, omission.objects)


def _used_meshes(scene: Scene) -> dict[int, str]:
    """Mesh index → the object to blame: the name of its first instance, and how many more there are."""
    owners: dict[int, list[str]] = {}
    for instance in scene.instances:
        owners.setdefault(instance.mesh, []).append(instance.name)
    return {mesh: names[0] if len(names) == 1 else f"{names[0]} (and {len(names) - 1} more with its mesh)"
            for mesh, names in owners.items()}


def _check_meshes(scene: Scene):
    owners = _used_meshes(scene)
    if not any(len(scene.meshes[index].triangles) for index in owners):
        yield Finding("error", scene.name or "scene", "has no geometry", "add a mesh that is visible to renders")
    for index, owner in owners.items():
        mesh = scene.meshes[index]
        if len(mesh.triangles) == 0:
            continue
        if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices_local):
            yield Finding("error", owner, "has faces that name vertices it lacks", "run Mesh > Clean Up or Validate on it")
            continue
        # All of them at once first: reducing over an axis of three costs numpy several times as much.
        broken = 0 if np.isfinite(mesh.vertices_local).all() else int(
            np.count_nonzero(~np.isfinite(mesh.vertices_local).all(axis=1)))
        if broken:
            yield Finding("error", owner, f"has {broken} vertices at NaN or infinity",
                          "delete them, or mend the modifier that makes them")
            continue
        flat = _count_degenerate(mesh.vertices_local, mesh.triangles)
        if flat == len(mesh.triangles):
            yield Finding("warning", owner, "has no face with an area", "it casts and reflects nothing: hide it or mend it")
        elif flat:
            yield Finding("warning", owner, f"has {flat} faces without area",
                          "they are left out; Mesh > Clean Up > Degenerate Dissolve removes them")


def _count_degenerate(vertices: np.ndarray, triangles: np.ndarray) -> int:
    found = 0
    for rows in blocks(len(triangles)):
        corners = vertices[triangles[rows]]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        third = second - first
        longest = np.maximum(np.maximum(_squared(first), _squared(second)), _squared(third))
        found += int(np.count_nonzero(_squared(cross(first, second)) <= np.square(DEGENERATE * longest)))
    return found


def _squared(vectors: np.ndarray) -> np.ndarray:
    """Squared length in float64: the fourth powers compared above leave float32's range at a millimetre."""
    return np.einsum("ij,ij->i", vectors, vectors, dtype=np.float64)


def _check_instances(scene: Scene):
    if not scene.instances:
        return
    matrices = np.stack([np.asarray(instance.world_from_local, np.float64) for instance in scene.instances])
    finite = np.isfinite(matrices).all(axis=(1, 2))
    axes = np.linalg.svd(np.where(finite[:, None, None], matrices, np.eye(4))[:, :3, :3], compute_uv=False)
    for row in np.flatnonzero(~finite):
        yield Finding("error", scene.instances[row].name, *BROKEN_TRANSFORM)
    for row in np.flatnonzero(finite & (axes[:, 2] <= SINGULAR * axes[:, 0])):
        message = "is scaled to nothing" if axes[row, 1] <= SINGULAR * axes[row, 0] else "is scaled flat along an axis"
        yield Finding("warning", scene.instances[row].name, message, "faces that lose their area are left out: give it a scale")
    bounds = scene_bounds(scene)
    if bounds is None:
        return
    low, high = bounds
    size, reach = float(np.linalg.norm(high - low)), float(np.abs(bounds).max())
    name = scene.name or "scene"
    if size > 0 and reach > FAR_IN_SCENE_SIZES * size:
        yield Finding("warning", name, f"is {size:.3g} m large but lies {reach:.3g} m from the origin",
                      "32-bit coordinates lose its detail there: move it nearer to the origin")
    if not SMALLEST_SCENE <= size <= LARGEST_SCENE:
        yield Finding("warning", name, f"is {size:.3g} m large", "check its scale and the scene's unit scale")


def instance_corners(scene: Scene) -> np.ndarray:
    """World-space corners (i, 8, 3) float64 of every instance's local bounding box; NaN where it has no finite vertices."""
    boxes = np.full((len(scene.meshes), 2, 3), np.nan)
    for index in {instance.mesh for instance in scene.instances}:
        vertices = scene.meshes[index].vertices_local
        if len(vertices):
            boxes[index] = extent(vertices)
    corners = boxes[:, (UNIT_BOX > 0).astype(int), np.arange(3)][[instance.mesh for instance in scene.instances]]
    matrices = np.stack([np.asarray(instance.world_from_local, np.float64) for instance in scene.instances])
    with np.errstate(invalid="ignore"):
        world = np.einsum("iab,ikb->ika", matrices[:, :3, :3], corners) + matrices[:, None, :3, 3]
    return np.where(np.isfinite(world).all(axis=(1, 2), keepdims=True), world, np.nan)


def scene_bounds(scene: Scene) -> np.ndarray | None:
    """Lowest and highest world-space corner (2, 3) float64 of a box around all instances, or None without finite geometry."""
    corners = instance_corners(scene).reshape(-1, 3) if scene.instances else np.empty((0, 3))
    corners = corners[np.isfinite(corners).all(axis=1)]
    return np.stack([corners.min(axis=0), corners.max(axis=0)]) if len(corners) else None


def used_materials(scene: Scene) -> np.ndarray:
    """Indices of the materials that some instance's triangles carry, overrides applied; out-of-range ones included."""
    per_mesh = {index: np.unique(scene.meshes[index].triangle_material) for index in {i.mesh for i in scene.instances}}
    found: set[int] = set()
    for instance in scene.instances:
        override = instance.material_override or {}
        found.update(override.get(int(index), int(index)) for index in per_mesh[instance.mesh])
    return np.array(sorted(found), np.int64)


def _check_materials(scene: Scene):
    used = used_materials(scene)
    # A scene without materials is drawn in one default grey.
    if scene.materials and used.size and (used.min() < 0 or used.max() >= len(scene.materials)):
        yield Finding("error", scene.name or "scene", "has faces that name materials it lacks", "assign materials to every face")
    for index in used[(used >= 0) & (used < len(scene.materials))]:
        material = scene.materials[index]
        albedo, emission = _range(scene, material.albedo), _range(scene, material.emission)
        where = f"material {material.name}"
        if albedo is None or emission is None:
            which = "base colour" if albedo is None else "emission"
            yield Finding("error", where, f"has NaN or infinity in its {which}", "mend the value, or the image it comes from")
            continue
        # White texels are everyday; only a value above white is trouble there, while a uniform 1 never stops bouncing.
        if albedo[1] > WHITE or (albedo[1] >= 1 and material.albedo.is_constant):
            yield Finding("warning", where, f"reflects {albedo[1]:.4g} of the light that meets it",
                          "albedo is cut just below 1, or light would never die out: use 0.8 or less for white paint")
        if albedo[0] < 0:
            yield Finding("warning", where, "has a negative base colour", "it is baked as black: give a colour from 0 to 1")
        if emission[0] < 0:
            yield Finding("warning", where, "has negative emission", "it is baked as none: give a strength from 0")


def _range(scene: Scene, channel: Channel) -> tuple[float, float] | None:
    """Lowest and highest value a channel can take, or None if some value is not finite."""
    low = high = np.asarray(channel.constant, np.float64)
    factors = []
    if channel.texture is not None:
        pixels = channel.texture.pixels
        factors.append((0.0, 1.0) if pixels.dtype == np.uint8 else _extent(pixels[..., :3]))
    if channel.attribute is not None:
        for mesh in scene.meshes:
            if channel.attribute in mesh.attributes:
                factors.append(_extent(mesh.attributes[channel.attribute][..., :3]))
    for lowest, highest in factors:
        products = np.stack([low * lowest, low * highest, high * lowest, high * highest])
        low, high = products.min(axis=0), products.max(axis=0)
    offset = np.zeros(3) if channel.offset is None else np.asarray(channel.offset, np.float64)
    low, high = low + offset, high + offset
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return None
    return float(low.min()), float(high.max())


def _extent(values: np.ndarray) -> tuple[float, float]:
    """Lowest and highest of an array; NaN anywhere makes both NaN."""
    return (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)


def _check_media(scene: Scene):
    for medium in scene.media:
        where = medium.name
        coefficients = {"scattering": medium.scattering, "absorption": medium.absorption, "emission": medium.emission}
        matrices = [part.world_from_local for part in (medium.bounds, medium.grid) if part is not None]
        if not all(np.isfinite(matrix).all() for matrix in matrices):
            yield Finding("error", where, *BROKEN_TRANSFORM)
            continue
        if any(np.linalg.matrix_rank(np.asarray(matrix)[:3, :3], SINGULAR) < 3 for matrix in matrices):
            yield Finding("error", where, "is scaled to nothing along an axis", "give it a scale on all three axes")
            continue
        if medium.grid is not None:
            if medium.grid.density.size == 0:
                yield Finding("error", where, "has a medium on a grid without cells", "give its grid cells, or hide it")
                continue
            coefficients |= {f"grid of {name}": values for name in ("density", "scattering", "absorption", "emission")
                             if (values := getattr(medium.grid, name)) is not None}
        for name, values in coefficients.items():
            lowest, highest = _extent(np.asarray(values))
            if not (np.isfinite(lowest) and np.isfinite(highest)):
                yield Finding("error", where, f"has NaN or infinity in its medium's {name}", "mend its nodes or its file")
            elif lowest < 0:
                yield Finding("error", where, f"has negative values in its medium's {name}", "give values from 0")
        if medium.fills_space and np.any((np.asarray(medium.emission) > 0) & (medium.extinction <= 0)):
            yield Finding("error", where, "gives light everywhere and takes none of it: along a ray into the sky it never ends",
                          "give its volume a density that scatters or absorbs, or put the glow into a mesh")
        if not abs(medium.phase.anisotropy) < 1:
            yield Finding("error", where, f"scatters with an anisotropy of {medium.phase.anisotropy:g}",
                          "give one between -1 and 1")


def _check_lights(scene: Scene):
    shining = False
    for light in scene.lights:
        power = light.strength
        where = f"light {light.name}"
        vectors = [power] + [np.asarray(getattr(light, name)) for name in (
            "position_world", "direction_world", "half_u_world", "half_v_world", "normal_world") if hasattr(light, name)]
        if light.profile is not None:
            vectors += [table for table in (light.profile.by_direction, light.profile.by_place, light.profile.by_distance)
                        if table is not None]
        if not all(np.isfinite(vector).all() for vector in vectors):
            yield Finding("error", where, "has NaN or infinity in its power or transform", "mend its power, colour or transform")
            continue
        if np.any(power < 0):
            yield Finding("warning", where, "has negative power", "a bake adds light only: give a power from 0")
        if isinstance(light, AreaLight) and light.area == 0:
            yield Finding("warning", where, "has no size", "it emits nothing: give it a size or use a point light")
            continue
        shining = shining or bool(np.any(power > 0))
    equirect = scene.world.equirect
    lowest, highest = _extent(equirect)
    if not (np.isfinite(lowest) and np.isfinite(highest)):
        yield Finding("error", "world", f"has NaN or infinity in its radiance ({scene.world.description})",
                      "mend its image or strength")
    elif lowest < 0:
        yield Finding("warning", "world", "has negative radiance", "it is baked as black there: give a strength from 0")
    materials = scene.materials
    emissive = any(materials[index].is_emissive for index in used_materials(scene) if 0 <= index < len(materials))
    emissive = emissive or any(medium.is_emissive for medium in scene.media)
    if not shining and scene.world.is_black and not emissive:
        dark = "all its lamps are at zero power" if scene.lights else "no lamp, a black world, no emissive material in use"
        yield Finding("error", scene.name or "scene", f"has no light ({dark})",
                      "add a lamp, light the world or give a material emission")


def _check_volumes(scene: Scene):
    if not scene.volumes:
        yield Finding("error", scene.name or "scene", "has no probe volume", "add one with Add > Light Probe > Volume")
    bounds = scene_bounds(scene)
    if bounds is not None:
        # Probes above open ground are where they should be: the air near the geometry belongs to the scene.
        margin = NEAR * np.linalg.norm(bounds[1] - bounds[0])
        surroundings = UNIT_BOX * (0.5 * (bounds[1] - bounds[0]) + margin) + bounds.mean(axis=0)
    for volume in scene.volumes:
        where = f"volume {volume.name}"
        matrix = np.asarray(volume.world_from_local, np.float64)
        if not np.isfinite(matrix).all():
            yield Finding("error", where, *BROKEN_TRANSFORM)
            continue
        axes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
        if axes[2] <= SINGULAR * axes[0]:
            yield Finding("error", where, "is scaled to nothing along an axis", "give it a scale on all three axes")
            continue
        if min(volume.resolution) < 1:
            yield Finding("error", where, f"has a resolution of {' × '.join(map(str, volume.resolution))}",
                          "give at least 1 on each axis")
            continue
        if bounds is not None:
            # Two boxes are apart if they are so along the axes of either: both frames are tried.
            world = UNIT_BOX @ matrix[:3, :3].T + matrix[:3, 3]
            local = (surroundings - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
            if _apart(world, surroundings) or _apart(UNIT_BOX, local):
                yield Finding("warning", where, "lies entirely outside the scene", "move it to where light is to be known")


def _check_spheres(scene: Scene):
    for probe in scene.spheres:
        where = f"sphere probe {probe.name}"
        if not probe.is_regular:
            yield Finding("error", where, "has a transform or distance that makes no volume of it",
                          "give it a scale on all three axes, and distances above 0", (probe.name,))
        elif not 0 <= probe.clip_start < probe.clip_end:
            yield Finding("error", where, f"has a Clip Start of {probe.clip_start:g} m and a Clip End of {probe.clip_end:g} m",
                          "give an end beyond the start", (probe.name,))
    if len(scene.spheres) > MOST_SPHERES:
        yield Finding("error", scene.name or "scene", f"has {len(scene.spheres)} sphere probes, and {MOST_SPHERES} is the most "
                      "that reflections are read from", "hide some of them from renders")


def _apart(one: np.ndarray, other: np.ndarray) -> bool:
    """True if the axis-aligned boxes around two sets of points (n, 3) do not meet."""
    return bool(np.any(one.max(axis=0) < other.min(axis=0)) or np.any(other.max(axis=0) < one.min(axis=0)))


def _check_memory(scene: Scene, sh_order: int, memory_bytes: int | None):
    found = shortage(estimate_bytes(scene, sh_order), available_bytes() if memory_bytes is None else memory_bytes)
    if found is not None:
        yield Finding("error", scene.name or "scene", *found)
