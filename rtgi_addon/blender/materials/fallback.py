"""Let Cycles evaluate what nodes do not tell: bake sockets of a material over one object's surface, in a scene of its own.

Each unreadable socket is wired to an emission shader in a copy of the material and baked (EMIT); a closure without a formula is
baked by its diffuse colour (DIFFUSE, COLOR) and its emission. Few polygons bake to a texture over a UV map made for it, many to
corner attributes. The user's scene, selection and materials are never touched; every temporary datablock is removed.
"""

from dataclasses import dataclass
from typing import NamedTuple

import addon_utils
import bpy
import numpy as np

from ...errors import BakeError
from .answered import answer, answered
from .atlas import polygon_uv
from .circumstances import Ray, questions
from .detail import doubtful_places, doubtful_polygons, magnified, sharpened
from .nodes import NodeReader
from .shaders import ShaderReader, Surface
from .values import ComputedTexture, Mapping, Unreadable, Value, texels

BAKE_UV = "_rtgi_bake"
# Side of a baked texture by the number of polygons that share it; beyond the last, corners resolve as much as texels would.
RESOLUTIONS = {1024: 512, 4096: 1024}
SAMPLES = 4
# So many polygons of those that bake to corners may have texels as well, on a texture of this side.
DETAILED, DETAIL_SIDE = 1024, 512
_MARGIN = 2
_MOST_UV_MAPS = 8
_PLACEHOLDER = ComputedTexture("bake", np.ones((1, 1, 3), np.float32), False, "EXTEND")
BAKE_MAPPING = Mapping(BAKE_UV)


@dataclass(frozen=True)
class Leaf:
    """An output socket to bake: the names of the group nodes around it, its node, its identifier, EMIT or DIFFUSE, and the ray that
    it is to answer, without what it does not ask of one."""

    path: tuple[str, ...]
    node: str
    socket: str
    kind: str
    ray: Ray


class BakedNodes(NodeReader):
    """Evaluates what is constant for a ray and an object, and takes everything else from ``baked``; leaves not in it are added to
    ``wanted``, and a placeholder stands for each."""

    def __init__(self, images, baked: dict[Leaf, Value], ray: Ray, placed: tuple, wanted: list[Leaf] | None):
        super().__init__(images, set(), ray, placed)
        self._plain = NodeReader(images, set(), ray, placed)
        self._baked, self._wanted = baked, wanted

    def output(self, out, path: tuple) -> Value:
        """The value of a node's output: constant, or baked."""
        try:
            value = self._plain.output(out, path)
            if value.is_constant:
                return value
        except Unreadable:
            pass
        return self.leaf(out, path, "EMIT")

    def leaf(self, out, path: tuple, kind: str) -> Value:
        """The baked value of an output, or a placeholder while leaves are collected."""
        ray = self.ray.seen_by(questions(out, path))
        leaf = Leaf(tuple(node.name for node in path), out.node.name, out.identifier, kind, ray)
        if leaf in self._baked:
            return self._baked[leaf]
        if leaf not in self._wanted:
            self._wanted.append(leaf)
        return Value(np.ones(3, np.float32), _PLACEHOLDER, mapping=BAKE_MAPPING)


class BakedShaders(ShaderReader):
    """Reads closures by formula where there is one, else by their baked diffuse colour and emission."""

    def unknown(self, out, path: tuple) -> Surface:
        """A closure without a formula, as Cycles bakes it: of what is no diffuse closure it says black."""
        self._remark(f"its {out.node.bl_label} has no formula here: the diffuse colour that Cycles bakes of it is taken, which may "
                     "be black")
        color = self._nodes.leaf(out, path, "DIFFUSE")
        return Surface(color, self._nodes.leaf(out, path, "EMIT"), base_color=color)


class Baked(NamedTuple):
    """The ``values`` of leaves by slot and the UV map (loops, 2) of their textures; without one the values are 1-row textures whose
    column is the loop index. ``detail`` has some polygons again, with a UV map, and ``inside`` (loops,) tells which those are."""

    values: dict[int, dict[Leaf, Value]]
    uv: np.ndarray | None
    inside: np.ndarray | None = None
    detail: "Baked | None" = None


def bake_leaves(request, leaves: dict[int, list[Leaf]], scene) -> Baked:
    """Bake the leaves of each slot of a request. Raises BakeError if Cycles cannot bake."""
    _require_cycles(request.name)
    polygons = _polygons_of(request, leaves)
    room = len(request.mesh.uv_layers) < _MOST_UV_MAPS
    count = np.count_nonzero(polygons)
    resolution = next((side for most, side in RESOLUTIONS.items() if count <= most), 0) if room else 0
    uv = _unwrapped(request, polygons, resolution) if resolution else None
    baked = Baked(_bake(request, leaves, scene, uv, resolution), uv)
    if uv is not None or not room:
        return baked
    starts, areas = _polygons(request.mesh)
    shining = [texels(value)[0] for values in baked.values.values() for leaf, value in values.items()
               if leaf.kind == "EMIT" and not value.is_constant]
    doubtful = [doubtful_polygons(np.where(np.isfinite(corners), corners, 0.0), starts, areas, DETAILED) for corners in shining]
    chosen = np.zeros(len(starts), bool)
    for found in doubtful:
        chosen[found[:DETAILED // len(doubtful)]] = True
    chosen &= polygons
    if not chosen.any():
        return baked
    uv = _unwrapped(request, chosen, DETAIL_SIDE)
    inside = np.repeat(chosen, np.diff(np.append(starts, len(request.mesh.loops))))
    return baked._replace(inside=inside, detail=Baked(_bake(request, leaves, scene, uv, DETAIL_SIDE), uv))


def bake_on_corners(request, leaves: dict[int, list[Leaf]], scene) -> dict[int, dict[Leaf, Value]]:
    """The leaves of each slot of a request at the corners of its mesh: see ``Baked``. Raises BakeError if Cycles cannot bake."""
    _require_cycles(request.name)
    return _bake(request, leaves, scene, None, 0)


def _bake(request, leaves, scene, uv: np.ndarray | None, resolution: int) -> dict[int, dict[Leaf, Value]]:
    with _Stage(request, scene, uv, resolution) as stage:
        result = {slot: {} for slot in leaves}
        for kind in ("EMIT", "DIFFUSE"):
            queues = {slot: [leaf for leaf in wanted if leaf.kind == kind] for slot, wanted in leaves.items()}
            for turn in range(max(map(len, queues.values()), default=0)):
                active = {slot: queue[turn] for slot, queue in queues.items() if turn < len(queue)}
                for slot, leaf in active.items():
                    stage.expose(slot, leaf)
                stage.bake(kind)
                for slot, (rgb, filled) in stage.results(kind, list(active)).items():
                    leaf = active[slot]
                    result[slot][leaf] = _value(rgb, filled, f"{request.materials[slot].name}: {leaf.node}")
    return result


def _polygons(mesh) -> tuple[np.ndarray, np.ndarray]:
    """First loop and area (polygons,) of each polygon."""
    starts, areas = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("loop_start", starts)
    mesh.polygons.foreach_get("area", areas)
    return starts, areas


def _polygons_of(request, slots) -> np.ndarray:
    """(polygons,) bool: those whose material slot is among ``slots``; Blender takes the last slot for any beyond it."""
    index = np.empty(len(request.mesh.polygons), np.int32)
    request.mesh.polygons.foreach_get("material_index", index)
    return np.isin(np.clip(index, 0, len(request.materials) - 1), list(slots))


def _unwrapped(request, chosen: np.ndarray, resolution: int) -> np.ndarray:
    """(loops, 2) UV of the chosen polygons at the size they have in the world; the others shrink to a point."""
    mesh = request.mesh
    count = len(mesh.polygons)
    starts, counts = np.empty(count, np.int32), np.empty(count, np.int32)
    normals, vertex = np.empty(count * 3, np.float32), np.empty(len(mesh.loops), np.int32)
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.polygons.foreach_get("loop_start", starts)
    mesh.polygons.foreach_get("loop_total", counts)
    mesh.polygons.foreach_get("normal", normals)
    mesh.loops.foreach_get("vertex_index", vertex)
    mesh.vertices.foreach_get("co", points)
    scale = np.linalg.norm(np.array(request.world_from_local)[:3, :3], axis=0).max()
    loops = np.flatnonzero(np.repeat(chosen, counts))
    kept = counts[chosen].astype(np.int64)
    uv = np.zeros((len(mesh.loops), 2), np.float32)
    if len(loops):
        uv[loops] = polygon_uv(points.reshape(-1, 3)[vertex[loops]] * scale, normals.reshape(-1, 3)[chosen],
                               np.cumsum(kept) - kept, kept, resolution)
    return uv


def _require_cycles(name: str) -> None:
    if not hasattr(bpy.types.Scene, "cycles"):
        addon_utils.enable("cycles")
    if not hasattr(bpy.types.Scene, "cycles"):
        raise BakeError(f"the materials of '{name}' need Cycles to be read, and this Blender has no Cycles",
                        "simplify their nodes to Principled, Image Texture and Mix, or use a Blender with Cycles")


class _Stage:
    """A scene of its own with the object, its materials' copies and what to bake into; all gone on exit."""

    def __init__(self, request, scene, uv: np.ndarray | None, resolution: int):
        self._request, self._source, self._uv, self._resolution = request, scene, uv, resolution
        self._remove: list[tuple] = []
        self._images: dict[int, object] = {}
        self._copies: dict[tuple[int, Ray], object] = {}

    def __enter__(self) -> "_Stage":
        try:
            self._build()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_exception) -> None:
        for collection, datablock in reversed(self._remove):
            collection.remove(datablock)
        self._remove.clear()
        mesh = self._request.mesh
        if BAKE_UV in mesh.attributes:  # a next stage adds its own
            mesh.attributes.remove(mesh.attributes[BAKE_UV])

    def _own(self, collection, datablock):
        self._remove.append((collection, datablock))
        return datablock

    def _build(self) -> None:
        mesh = self._request.mesh
        self._object = self._own(bpy.data.objects, bpy.data.objects.new("rtgi bake", mesh))
        self._scene = scene = self._own(bpy.data.scenes, bpy.data.scenes.new("rtgi bake"))
        scene.collection.objects.link(self._object)
        scene.frame_current, scene.frame_subframe = self._source.frame_current, self._source.frame_subframe
        scene.render.engine = "CYCLES"
        scene.cycles.device = "CPU"
        scene.cycles.samples = SAMPLES
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
        scene.camera = self._source.camera
        self._object.matrix_world = self._request.world_from_local
        if self._uv is not None:
            mesh.uv_layers.new(name=BAKE_UV, do_init=False).uv.foreach_set("vector", self._uv.ravel())
        else:
            layer = mesh.color_attributes.new(BAKE_UV, "FLOAT_COLOR", "CORNER")
            mesh.color_attributes.active_color = layer
        for slot in range(len(self._request.materials)):
            if slot < len(mesh.materials):
                mesh.materials[slot] = self._blank(slot)
            else:
                mesh.materials.append(self._blank(slot))
        view_layer = scene.view_layers[0]
        view_layer.update()
        self._object.select_set(True, view_layer=view_layer)
        view_layer.objects.active = self._object

    def _blank(self, slot: int):
        """A material for a slot that is not baked: Cycles wants an image to bake into in every slot."""
        material = self._own(bpy.data.materials, bpy.data.materials.new("rtgi bake"))
        _ensure_nodes(material)
        self._add_target(material, slot, 4)
        return material

    def _add_target(self, material, slot: int, side: int) -> None:
        if self._uv is None:
            return
        if slot not in self._images or self._images[slot].size[0] != side:
            self._images[slot] = self._own(bpy.data.images, bpy.data.images.new("rtgi bake", side, side, alpha=True,
                                                                                 float_buffer=True))
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = self._images[slot]
        material.node_tree.nodes.active = node

    def _copy_of(self, slot: int, ray: Ray):
        """A copy of a slot's material that answers ``ray``."""
        if (slot, ray) not in self._copies:
            copy = self._own(bpy.data.materials, self._request.materials[slot].copy())
            answer(copy.node_tree, ray, self._request.placed[slot], self._remove)
            self._add_target(copy, slot, self._resolution)
            self._copies[slot, ray] = copy
        return self._copies[slot, ray]

    def expose(self, slot: int, leaf: Leaf) -> None:
        """Show a leaf on a slot: wire it to the output of a copy of the material, through the groups around it."""
        material = self._request.mesh.materials[slot] = self._copy_of(slot, leaf.ray)
        tree = material.node_tree
        out = self._lifted(tree, leaf.path, slot, leaf)
        for node in tree.nodes:
            if node.bl_idname == "ShaderNodeOutputMaterial":
                node.is_active_output = False
        end = tree.nodes.new("ShaderNodeOutputMaterial")
        end.target = "CYCLES"
        end.is_active_output = True
        if out.type != "SHADER":
            emission = tree.nodes.new("ShaderNodeEmission")
            tree.links.new(out, emission.inputs["Color"])
            out = emission.outputs["Emission"]
        tree.links.new(out, end.inputs["Surface"])

    def _lifted(self, tree, path: tuple[str, ...], slot: int, leaf: Leaf):
        """The output socket, in ``tree``, that carries a leaf from within nested groups (which are copied to be changed)."""
        if not path:
            out = next(out for out in tree.nodes[leaf.node].outputs if out.identifier == leaf.socket)
            return answered(tree, out, leaf.ray, self._request.placed[slot])
        group = tree.nodes[path[0]]
        group.node_tree = inner = self._own(bpy.data.node_groups, group.node_tree.copy())
        out = self._lifted(inner, path[1:], slot, leaf)
        kind = "NodeSocketShader" if out.type == "SHADER" else "NodeSocketColor"
        entry = inner.interface.new_socket("rtgi bake", in_out="OUTPUT", socket_type=kind)
        end = next(node for node in inner.nodes if node.bl_idname == "NodeGroupOutput" and node.is_active_output)
        inner.links.new(out, next(into for into in end.inputs if into.identifier == entry.identifier))
        return next(out for out in group.outputs if out.identifier == entry.identifier)

    def bake(self, kind: str) -> None:
        """Run Cycles once over the object."""
        view_layer = self._scene.view_layers[0]
        context = {"scene": self._scene, "view_layer": view_layer, "object": self._object, "active_object": self._object,
                   "selected_objects": [self._object], "selected_editable_objects": [self._object]}
        target = {"target": "VERTEX_COLORS"} if self._uv is None else {"target": "IMAGE_TEXTURES", "uv_layer": BAKE_UV}
        for image in self._images.values():  # a cleared image would count as baked all over
            image.pixels.foreach_set(np.zeros(image.size[0] * image.size[1] * 4, np.float32))
        try:
            with bpy.context.temp_override(**context):
                done = bpy.ops.object.bake(type=kind, pass_filter={"COLOR"}, margin=_MARGIN, margin_type="EXTEND",
                                           use_clear=False, **target)
            if done != {"FINISHED"}:
                raise RuntimeError("it was cancelled")
        except RuntimeError as error:
            raise BakeError(f"Cycles could not bake the materials of '{self._request.name}' ({str(error).strip()})",
                            "simplify their nodes, or apply the object's modifiers and try again") from error

    def results(self, kind: str, slots: list[int]) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """What the last bake left for each of ``slots``: values (h, w, 3), and which of them (h, w) are known. Where a texture does
        not know the sum of its light well enough, some of it is baked again, finer."""
        found = {slot: self._pixels(slot) for slot in slots}
        if self._uv is None:
            return found
        places = {slot: doubtful_places(*pixels, SAMPLES) for slot, pixels in found.items()}
        layer = self._request.mesh.uv_layers[BAKE_UV].uv
        for place in sorted(set().union(*places.values())):
            layer.foreach_set("vector", magnified(self._uv, place).ravel())
            self.bake(kind)
            for slot in slots:
                if place in places[slot]:
                    found[slot] = (sharpened(*found[slot], place, *self._pixels(slot)), found[slot][1])
        layer.foreach_set("vector", self._uv.ravel())
        return found

    def _pixels(self, slot: int) -> tuple[np.ndarray, np.ndarray]:
        if self._uv is None:
            layer = self._request.mesh.color_attributes[BAKE_UV]
            pixels = np.empty(len(layer.data) * 4, np.float32)
            layer.data.foreach_get("color", pixels)
            pixels = pixels.reshape(1, -1, 4)
            counts = np.empty(len(self._request.mesh.polygons), np.int32)
            self._request.mesh.polygons.foreach_get("loop_total", counts)
            filled = np.repeat(_polygons_of(self._request, [slot]), counts)[None]
        else:
            image = self._images[slot]
            pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
            image.pixels.foreach_get(pixels)
            pixels = pixels.reshape(image.size[1], image.size[0], 4)
            filled = pixels[..., 3] > 0.0
        return pixels[..., :3].copy(), filled


def _value(rgb: np.ndarray, filled: np.ndarray, name: str) -> Value:
    """What a bake left; constant if it is the same everywhere. ``rgb`` (1, loops, 3) or (side, side, 3)."""
    seen = rgb[filled]
    if len(seen) and np.ptp(seen, axis=0).max() <= 1e-5 * max(1.0, float(np.abs(seen).max())):
        return Value.of(seen.mean(axis=0, dtype=np.float64))
    rgb = rgb if len(rgb) == 1 else filled_in(rgb, filled)
    return Value(np.ones(3, np.float32), ComputedTexture(name, rgb, False, "EXTEND"), mapping=BAKE_MAPPING)


def filled_in(rgb: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(side, side, 3) texels, the unknown ones from the mean of known ones nearby (the pull-push of Gortler et al. 1996):
    thin polygons cover fewer texel centres than lookups reach. ``side`` is a power of two."""
    if known.all() or len(rgb) == 1:
        return rgb
    half = len(rgb) // 2
    count = known.reshape(half, 2, half, 2).sum(axis=(1, 3))
    total = np.where(known[..., None], rgb, 0.0).reshape(half, 2, half, 2, 3).sum(axis=(1, 3))
    coarse = filled_in((total / np.maximum(count, 1)[..., None]).astype(np.float32), count > 0)
    return np.where(known[..., None], rgb, coarse.repeat(2, axis=0).repeat(2, axis=1))


def _ensure_nodes(material) -> None:
    if material.node_tree is None:
        material.use_nodes = True
