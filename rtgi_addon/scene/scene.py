"""The scene as plain arrays: the one hand-over between Blender (or a test) and light transport."""

from dataclasses import dataclass, field, replace

import numpy as np

from .lights import Light
from .linking import Linking
from .material import LOOK, Material
from .medium import Medium
from .omission import Omission
from .scattered import Scattered
from .sphere_probe import SphereProbe


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh in its own space.

    ``vertices_local`` (v, 3) float32; ``triangles`` (t, 3) int32; ``triangle_material`` (t,) int32 into ``Scene.materials``.
    ``corner_normals_local`` (t, 3, 3) float32 shading normals, or None where every face is flat. ``uv_layers`` maps a UV map's
    name to (t, 3, 2) float32 and ``active_uv`` names the one used for render; ``attributes`` maps a name to (t, 3, 4) float32
    scene-linear RGBA corners (vertex colours, results of the Cycles fallback). ``marked_edges`` (e, 2) int32 are pairs of vertices
    along which lines are drawn, or None.
    """

    name: str
    vertices_local: np.ndarray
    triangles: np.ndarray
    triangle_material: np.ndarray
    corner_normals_local: np.ndarray | None = None
    uv_layers: dict[str, np.ndarray] = field(default_factory=dict)
    active_uv: str | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)
    marked_edges: np.ndarray | None = field(default=None, metadata=LOOK)


# What an instance is to a bake (``Instance.bake``): part of it, or lit by it alone.
STATIC, DYNAMIC = "STATIC", "DYNAMIC"


@dataclass(frozen=True, eq=False)
class Instance:
    """One placement of a mesh: ``mesh`` indexes ``Scene.meshes``; ``world_from_local`` (4, 4) float64, any affine map (mirrored
    and sheared included). ``material_override`` maps the mesh's material indices to others, or is None.

    ``visible_camera``, ``visible_diffuse``, ``visible_shadow`` and ``visible_scatter`` (of rays that media have scattered) are
    Blender's ray visibility: which kinds of rays meet it. What is hidden from diffuse rays lights no surface by emission. A
    ``DYNAMIC`` one is in pictures and receives light, but no bake knows it. ``linking`` (None: everything) is that of its emission,
    and ``light_group`` names the group of lights that this belongs to ("": none). ``pass_index`` and the names of its
    ``collections`` choose it for styles. ``atlas`` names the UV map at whose texels its light is baked (None: it is not).
    """

    name: str
    mesh: int
    world_from_local: np.ndarray
    material_override: dict[int, int] | None = None
    visible_camera: bool = True
    visible_diffuse: bool = True
    visible_shadow: bool = True
    bake: str = STATIC
    linking: Linking | None = None
    pass_index: int = field(default=0, metadata=LOOK)
    collections: tuple[str, ...] = field(default=(), metadata=LOOK)
    light_group: str = ""
    visible_scatter: bool = True
    atlas: str | None = field(default=None, metadata=LOOK)


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


@dataclass(frozen=True)
class Mist:
    """How a world's mist thickens with distance from the eye, by Blender's own settings: from ``start`` on over ``depth`` [m], with
    ``falloff`` 'linear', 'quadratic' or 'inverse_quadratic'. It is a look, and no light: no bake depends on it."""

    start: float = 5.0
    depth: float = 25.0
    falloff: str = "quadratic"


@dataclass(frozen=True)
class NearSurfaces:
    """Which probes of a lattice are worth rays: those that are read by a surface, or by what stands up to ``clearance`` [m] off
    one. Surfaces up to ``outside`` [m] outside the box count for the probes that they read there; ``outermost`` keeps the outermost
    layer whole, for surfaces anywhere outside."""

    clearance: float = 0.0
    outside: float = 0.0
    outermost: bool = True


@dataclass(frozen=True, eq=False)
class ProbeVolume:
    """A Light Probe Volume: the box local [−1, 1]³ under ``world_from_local`` (4, 4) float64, ``resolution`` (x, y, z) samples
    placed at cell centres. ``fitted`` tells one made up for a file that has none. ``settings`` holds the object's own
    overrides of the technique's settings (name → value). ``wanted`` (nz, ny, nx) bool tells the probes that are worth rays (None:
    all); the others stay in the lattice with validity 0, as if inside geometry. ``near`` leaves that to the bake, which looks where
    surfaces are. ``planned`` is the name of the volume that a plan placed this one in, and "" of those that are the user's own.

    ``capture_emission`` and ``capture_bounces`` say whether the light of emissive surfaces, and what lamps send by way of surfaces,
    is baked. ``intensity`` multiplies what is, and the world's light where ``capture_world`` is set (see `capture`).

    Probes of a ``scattered`` volume stand anywhere: ``resolution`` then only tells how the list of them lies in arrays and images,
    and ``nodes`` how finely it is looked up.
    """

    name: str
    world_from_local: np.ndarray
    resolution: tuple[int, int, int]
    fitted: bool = False
    settings: dict = field(default_factory=dict)
    wanted: np.ndarray | None = None
    capture_world: bool = True
    capture_emission: bool = True
    capture_bounces: bool = True
    intensity: float = 1.0
    near: NearSurfaces | None = None
    planned: str = ""
    scattered: Scattered | None = None

    @property
    def nodes(self) -> tuple[int, int, int]:
        """Nodes along x, y, z of the lattice that is looked up: the probes themselves, or what names scattered ones."""
        return self.resolution if self.scattered is None else self.scattered.resolution

    @property
    def captures_all(self) -> bool:
        """Whether it holds all light as it is."""
        return self.capture_emission and self.capture_bounces and self.intensity == 1.0


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
    missing images) and ``omissions`` what in it is not followed; ``source`` names the file; ``blender_version`` the version that
    read it; ``files`` are the paths of all that it was read from, with libraries and images. ``probe_points`` are the
    places (n, 3) float64 of Empties in the world by the names of collections, where scattered probes may be wanted.
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
    omissions: tuple[Omission, ...] = ()
    source: str = ""
    blender_version: str = ""
    mist: Mist = Mist()
    files: tuple[str, ...] = ()
    media: tuple[Medium, ...] = ()
    spheres: tuple[SphereProbe, ...] = ()
    probe_points: dict[str, np.ndarray] = field(default_factory=dict)


def seen_by_camera(scene: Scene) -> Scene:
    """``scene`` with its materials as a camera sees them, and as pictures of surfaces can draw them; itself where that is the
    same."""
    materials = tuple((material.camera or material).as_drawn for material in scene.materials)
    if all(shown is material for shown, material in zip(materials, scene.materials, strict=True)):
        return scene
    return replace(scene, materials=materials)


def drawn_otherwise(scene: Scene) -> str:
    """What of the surfaces no picture shows as bakes have it, as a sentence with names, or nothing (``Material.as_drawn``)."""
    names = dict.fromkeys(material.name for material in scene.materials if material.is_translucent)
    return f"pictures show the light that passes diffusely through {', '.join(names)} as reflected" if names else ""
