"""One lamp in an empty scene, with its own nodes and with a plain Emission: how much more light do the nodes send where?

White surfaces around the lamp and cameras that look at it are rendered by Cycles. Ratios of the two renders know nothing of how
bright the lamp is, how far the surface and how it is turned.
"""

from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix

from ...numerics.sampling import frame
from ...scene.lamp_profile import FARTHEST, NEAREST
from ..materials.answered import answer
from .lamp_nodes import ASKING
from .small_renders import add_camera, owned, panorama_settings, rendered

# Watts of the lamps: no more than a unit.
POWER = 100.0
# Size of what stands for the middle of an area lamp [its own units].
_SPECK = 1e-4
# Half the picture [its width over the distance] in which patches at all distances stand side by side: one direction, nearly.
_FAN = 2e-3
# Segments of a sphere between its poles: its facets are 0.03 % nearer than it.
_SEGMENTS = 64
# A texel that gets less than this share of the most light of the plain lamp lies outside its cone.
_OUTSIDE = 1e-3


@dataclass(frozen=True, eq=False)
class LampSource:
    """What is asked: ``data`` is Blender's own (not evaluated) lamp of ``kind``, ``settings`` its evaluated values by name;
    ``world_from_local`` (4, 4) where it is asked, ``index`` and ``color`` those of its object, ``frame_number`` of the scene's."""

    name: str
    kind: str
    data: bpy.types.Light
    settings: dict
    world_from_local: np.ndarray
    index: int = 0
    color: tuple = (1.0, 1.0, 1.0, 1.0)
    frame_number: tuple[int, float] = (1, 0.0)

    @property
    def rotation(self) -> np.ndarray:
        """(3, 3): the lamp's axes, orthonormal and right-handed; Z is exactly what it shines against."""
        return lamp_frame(self.world_from_local)


def lamp_frame(world_from_local: np.ndarray) -> np.ndarray:
    """An orthonormal right-handed frame (3, 3) with the lamp's Z, and its X as far as it stands across it."""
    linear = np.asarray(world_from_local, np.float64)[:3, :3]
    z = linear[:, 2] / max(np.linalg.norm(linear[:, 2]), 1e-300)
    if not z.any():
        z = np.array([0.0, 0.0, 1.0])
    x = linear[:, 0] - z * (z @ linear[:, 0])
    if np.linalg.norm(x) < 1e-9 * max(np.linalg.norm(linear[:, 0]), 1e-300) or not x.any():
        x = frame(z[None])[0][0]
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


class LampRig:
    """``source`` in a ``small_scene`` with its list of what was ``made``."""

    def __init__(self, scene, made: list, source: LampSource):
        self._scene, self._made, self.source = scene, made, source
        scene.frame_set(source.frame_number[0], subframe=source.frame_number[1])
        self._position, self._axes = np.asarray(source.world_from_local, np.float64)[:3, 3], source.rotation
        self._ground = owned(made, bpy.data.objects, bpy.data.objects.new(scene.name, None))
        scene.collection.objects.link(self._ground)
        self._lamps = {nodes: self._lamp(nodes) for nodes in (True, False)}
        self._holder = add_camera(scene, made, "PANO")
        self._camera = self._holder.data
        self._camera.clip_start, self._camera.clip_end = 1e-6, 1e9
        self._white = self._white_material()

    def shell(self, radius: float, rows: int, columns: int, reach: float, samples: int, whole: bool = False,
              seed: int = 0) -> tuple:
        """Irradiance on a sphere around the lamp over directions, as ``LampProfile.by_direction`` has them: that with nodes and the
        plain lamp's, (rows, columns, 3) each. ``whole``: of the lamp as large as it is, and with its own spread and blend."""
        mesh = self._sphere(radius)
        self._scene.cycles.seed = seed
        self._look("PANO", self._position, self._axes[:, [0, 2, 1]] * [1.0, 1.0, -1.0])
        self._latitudes(reach)
        # A plain lamp as small as a point has no grain.
        pictures = self._both(columns, rows, samples, whole, plain_samples=0 if whole else 1)
        bpy.data.objects.remove(mesh)
        self._scene.cycles.seed = 0
        order = (3 * columns // 4 - 1 - np.arange(columns)) % columns
        return tuple(np.pi * picture[:, order] for picture in pictures)

    def fan(self, direction: np.ndarray, count: int, samples: int) -> np.ndarray:
        """(count, 3): the share of the plain lamp's light that the nodes send along ``direction`` (3,) to the distances of
        ``LampProfile.by_distance``."""
        right, up = (axis[0] for axis in frame(-np.asarray(direction, np.float64)[None]))
        distance = np.geomspace(NEAREST, FARTHEST, count)
        edges = _FAN * (2.0 * np.arange(count + 1) / count - 1.0)
        x = np.stack([edges[:-1], edges[1:], edges[1:], edges[:-1]], axis=1)
        y = np.array([-1.0, -1.0, 1.0, 1.0]) * _FAN
        corners = distance[:, None, None] * (direction + x[..., None] * right + y[:, None] * up) + self._position
        mesh = self._mesh(corners.reshape(-1, 3), np.arange(4 * count).reshape(-1, 4))
        self._look("PERSP", self._position, np.stack([right, up, -np.asarray(direction)], axis=1))
        self._camera.sensor_fit, self._camera.angle = "HORIZONTAL", 2.0 * float(np.arctan(_FAN))
        node, plain = (picture.sum(axis=0, dtype=np.float64) for picture in self._both(count, 4, samples, False))
        bpy.data.objects.remove(mesh)
        return _over(node, plain)

    def place(self, rows: int, columns: int, distance: float, samples: int) -> tuple:
        """Radiance (rows, columns, 3) of an area lamp as a camera sees it whose picture it fills, ``distance`` [m] away, over its
        places as in ``LampProfile.by_place``, of the lamp with nodes and the plain one."""
        size_x, size_y = self._sides()
        back = -self._axes[:, 2]
        self._look("ORTHO", self._position + distance * back, np.stack([self._axes[:, 0], -self._axes[:, 1], back], axis=1))
        self._camera.sensor_fit, self._camera.ortho_scale = "HORIZONTAL", size_x
        ratio = size_y / size_x * columns / rows
        self._scene.render.pixel_aspect_x, self._scene.render.pixel_aspect_y = max(1.0, 1.0 / ratio), max(1.0, ratio)
        pictures = self._both(columns, rows, samples, True, True, 1)
        self._scene.render.pixel_aspect_x = self._scene.render.pixel_aspect_y = 1.0
        return tuple(picture[::-1] for picture in pictures)

    def hemisphere(self, place: tuple[float, float], rows: int, columns: int, samples: int) -> tuple:
        """Radiance (rows, columns, 3) over the directions of ``LampProfile.by_direction`` up to a right angle that an area lamp
        sends from about ``place`` (s, t), with nodes and plain, and the distance (rows,) [m] at which the camera saw it."""
        size_x, size_y = self._sides()
        height = max(1e-3 * min(size_x, size_y), 2.0 * NEAREST)
        linear = np.asarray(self.source.world_from_local, np.float64)[:3, :3]
        half_u, half_v = linear[:, 0] / np.linalg.norm(linear[:, 0]), linear[:, 1] / np.linalg.norm(linear[:, 1])
        at = self._position + 0.5 * (place[0] * size_x * half_u + place[1] * size_y * half_v) - height * self._axes[:, 2]
        self._look("PANO", at, self._axes[:, [0, 2, 1]] * [1.0, -1.0, 1.0])
        self._latitudes(0.5 * np.pi)
        order = (np.arange(columns) + columns // 4) % columns
        pictures = tuple(picture[:, order] for picture in self._both(columns, rows, samples, True, True, 1))
        return *pictures, height / np.cos((np.arange(rows) + 0.5) / rows * 0.5 * np.pi)

    def _sides(self) -> tuple[float, float]:
        settings, linear = self.source.settings, np.asarray(self.source.world_from_local, np.float64)[:3, :3]
        size_y = settings["size_y"] if settings["shape"] in {"RECTANGLE", "ELLIPSE"} else settings["size"]
        return settings["size"] * float(np.linalg.norm(linear[:, 0])), size_y * float(np.linalg.norm(linear[:, 1]))

    def _both(self, width: int, height: int, samples: int, whole: bool, seen: bool = False,
              plain_samples: int = 0) -> list[np.ndarray]:
        """The picture under the lamp with its nodes, and under the plain one, with as many samples (0) or with ``plain_samples``.
        ``seen``: of the lamps themselves."""
        self._scene.render.resolution_x, self._scene.render.resolution_y = width, height
        pictures = []
        for nodes in (True, False):
            for own, obj in self._lamps.items():
                obj.hide_render = own is not nodes
            self._set(self._lamps[nodes], whole, seen)
            pictures.append(rendered(self._scene, samples if nodes else plain_samples or samples))
        return pictures

    def _set(self, obj, whole: bool, seen: bool) -> None:
        data, settings = obj.data, self.source.settings
        for name, value in settings.items():
            setattr(data, name, value)
        obj.visible_camera = seen
        if not whole:
            if self.source.kind in ("POINT", "SPOT"):
                data.shadow_soft_size = 0.0
            if self.source.kind == "SPOT":
                data.spot_blend = 0.0
            if self.source.kind == "AREA":
                data.shape, data.size = "SQUARE", _SPECK
        if self.source.kind == "AREA" and (seen or not whole):
            data.spread = np.pi

    def _lamp(self, nodes: bool):
        data = owned(self._made, bpy.data.lights, self.source.data.copy())
        data.animation_data_clear()
        data.color, data.energy, data.exposure, data.use_temperature = (1.0, 1.0, 1.0), POWER, 0.0, False
        data.normalize, data.use_shadow = True, False
        if nodes:
            answer(data.node_tree, replace(ASKING, length=None), (), self._made)
        else:
            tree = data.node_tree
            tree.nodes.clear()
            emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputLight")
            emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1.0, 1.0, 1.0, 1.0), 1.0
            tree.links.new(emission.outputs[0], output.inputs["Surface"])
        obj = owned(self._made, bpy.data.objects, bpy.data.objects.new(self.source.name, data))
        # A parent's inverse keeps a shear; location, rotation and scale do not.
        obj.parent = self._ground
        obj.matrix_parent_inverse = Matrix(self.source.world_from_local.tolist())
        obj.pass_index, obj.color = self.source.index, self.source.color
        self._scene.collection.objects.link(obj)
        return obj

    def _look(self, kind: str, position: np.ndarray, axes: np.ndarray) -> None:
        """Point the camera: ``axes`` (3, 3) has its own as columns; it looks along −Z with +Y up."""
        self._camera.type = kind
        if kind == "PANO":
            panorama_settings(self._camera).panorama_type = "EQUIRECTANGULAR"
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = axes, position
        self._holder.matrix_world = Matrix(pose.tolist())

    def _latitudes(self, reach: float) -> None:
        settings = panorama_settings(self._camera)
        settings.latitude_min, settings.latitude_max = -0.5 * np.pi, min(reach - 0.5 * np.pi, 0.5 * np.pi)

    def _sphere(self, radius: float):
        angle = np.pi * np.arange(_SEGMENTS + 1) / _SEGMENTS
        azimuth = np.pi * np.arange(2 * _SEGMENTS) / _SEGMENTS
        local = np.stack(np.broadcast_arrays(np.sin(angle)[:, None] * np.cos(azimuth), np.sin(angle)[:, None] * np.sin(azimuth),
                                             -np.cos(angle)[:, None]), axis=-1)
        row, column = np.meshgrid(np.arange(_SEGMENTS), np.arange(2 * _SEGMENTS), indexing="ij")
        along = (column + 1) % (2 * _SEGMENTS)
        faces = np.stack([row * 2 * _SEGMENTS + column, row * 2 * _SEGMENTS + along, (row + 1) * 2 * _SEGMENTS + along,
                          (row + 1) * 2 * _SEGMENTS + column], axis=-1).reshape(-1, 4)
        return self._mesh(radius * local.reshape(-1, 3) @ self._axes.T + self._position, faces)

    def _mesh(self, vertices: np.ndarray, faces: np.ndarray):
        mesh = owned(self._made, bpy.data.meshes, bpy.data.meshes.new(self._scene.name))
        mesh.from_pydata(vertices.tolist(), [], faces.tolist())
        mesh.materials.append(self._white)
        obj = bpy.data.objects.new(self._scene.name, mesh)
        self._scene.collection.objects.link(obj)
        return obj

    def _white_material(self):
        material = owned(self._made, bpy.data.materials, bpy.data.materials.new(self._scene.name))
        if material.node_tree is None:
            material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        output, diffuse = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
        return material


def ratio_of(node: np.ndarray, plain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The share (…, 3) float64 of the plain lamp's light that nodes make, 0 where that shines not, and (…) bool where it does."""
    level = plain.max(axis=-1)
    lit = level > _OUTSIDE * level.max()
    return np.where(lit[..., None], _over(node, plain), 0.0), lit


def _over(node: np.ndarray, plain: np.ndarray) -> np.ndarray:
    plain = np.asarray(plain, np.float64)
    return np.maximum(np.divide(node, plain, out=np.zeros(plain.shape), where=plain > 0.0), 0.0)
