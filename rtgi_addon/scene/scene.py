"""The scene as plain arrays: the one hand-over between Blender (or a test) and light transport."""

from dataclasses import dataclass, field

import numpy as np

from .lights import Light
from .material import Material


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in its own space.

    ``vertices_local`` (v, 3) float32; ``triangles`` (t, 3) int32; ``triangle_material`` (t,) int32 into ``Scene.materials``.
    ``corner_normals_local`` (t, 3, 3) float32 shading normals, or None where every face is flat. ``uv_layers`` maps a UV map's
    name to (t, 3, 2) float32 and ``active_uv`` names the one used for render; ``attributes`` maps a name to (t, 3, 4) float32
    scene-linear RGBA corners (vertex colours, results of the Cycles fallback).
    """

    name: str
    vertices_local: np.ndarray
    triangles: np.ndarray
    triangle_material: np.ndarray
    corner_normals_local: np.ndarray | None = None
    uv_layers: dict[str, np.ndarray] = field(default_factory=dict)
    active_uv: str | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Instance:
    """One placement of a mesh: ``mesh`` indexes ``Scene.meshes``; ``world_from_local`` (4, 4) float64, any affine map (mirrored
    and sheared included). ``material_override`` maps the mesh's material indices to others, or is None."""

    name: str
    mesh: int
    world_from_local: np.ndarray
    material_override: dict[int, int] | None = None


@dataclass(frozen=True, eq=False)
class World:
    """The radiance of the surroundings [W·sr⁻¹·m⁻²].

    ``equirect`` (h, w, 3) float32 in Blender's equirectangular layout with row 0 at the bottom (−Z): with d = ``map_from_world``·
    direction_world, u = ½ − atan2(d.y, d.x)/2π and v = atan2(d.z, hypot(d.x, d.y))/π + ½ (Cycles `projection.h`,
    direction_to_equirectangular). A (1, 1, 3) map is a constant. ``map_from_world`` is a (3, 3) rotation.
    """

    equirect: np.ndarray
    map_from_world: np.ndarray = field(default_factory=lambda: np.eye(3))
    description: str = "constant"

    @staticmethod
    def constant(radiance) -> "World":
        """The same radiance (scalar or RGB) from everywhere."""
        return World(np.broadcast_to(np.asarray(radiance, np.float32), (1, 1, 3)).copy())

    @property
    def is_black(self) -> bool:
        """True if no light comes from the world."""
        return not bool(np.any(self.equirect > 0))


@dataclass(frozen=True, eq=False)
class ProbeVolume:
    """A Light Probe Volume: the box local [−1, 1]³ under ``world_from_local`` (4, 4) float64, ``resolution`` (x, y, z) samples
    placed at cell centres. ``fitted`` tells one made up for a file that has none. ``settings`` holds the object's own
    overrides of the technique's settings (name → value). ``wanted`` (nz, ny, nx) bool tells the probes that are worth rays (None:
    all); the others stay in the lattice with validity 0, as if inside geometry."""

    name: str
    world_from_local: np.ndarray
    resolution: tuple[int, int, int]
    fitted: bool = False
    settings: dict = field(default_factory=dict)
    wanted: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective or orthographic view: ``world_from_camera`` (4, 4), looking along −Z with +Y up; ``clip_from_camera`` (4, 4)
    the projection matrix for ``resolution`` (width, height) pixels, row 0 at the top."""

    name: str
    world_from_camera: np.ndarray
    clip_from_camera: np.ndarray
    resolution: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything light transport may know. Frozen; arrays are never written after construction.

    ``notes`` are lines for the user about how it was read (fitted volume, materials read through the Cycles fallback,
    missing images); ``source`` names the file; ``blender_version`` the version that read it.
    """

    name: str
    meshes: tuple[Mesh, ...] = ()
    instances: tuple[Instance, ...] = ()
    materials: tuple[Material, ...] = ()
    lights: tuple[Light, ...] = ()
    world: World = field(default_factory=lambda: World.constant(0.0))
    volumes: tuple[ProbeVolume, ...] = ()
    cameras: tuple[Camera, ...] = ()
    notes: tuple[str, ...] = ()
    source: str = ""
    blender_version: str = ""
