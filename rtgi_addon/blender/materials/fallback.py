"""Let Cycles evaluate what nodes do not tell: bake sockets of a material over one object's surface, in a scene of its own.

Each unreadable socket is wired to an emission shader in a copy of the material and baked (EMIT); a closure without a formula is
baked by its diffuse colour (DIFFUSE, COLOR) and its emission. Few polygons bake to a texture over a UV map made for it, many to
corner attributes. The user's scene, selection and materials are never touched; every temporary datablock is removed.
"""

from dataclasses import dataclass

import addon_utils
import bpy
import numpy as np

from ...errors import BakeError
from .atlas import polygon_uv
from .nodes import NodeReader
from .shaders import ShaderReader, Surface
from .values import ComputedTexture, Mapping, Unreadable, Value

BAKE_UV = "_rtgi_bake"
# Side of a baked texture by the number of polygons that share it; beyond the last, corners resolve as much as texels would.
RESOLUTIONS = {1024: 512, 4096: 1024}
SAMPLES = 4
_MARGIN = 2
_MOST_UV_MAPS = 8
_PLACEHOLDER = ComputedTexture("bake", np.ones((1, 1, 3), np.float32), False, "EXTEND")
_MAPPING = Mapping(BAKE_UV)


@dataclass(frozen=True)
class Leaf:
    """An output socket to bake: the names of the group nodes around it, its node, its identifier, and EMIT or DIFFUSE."""

    path: tuple[str, ...]
    node: str
    socket: str
    kind: str


class BakedNodes(NodeReader):
    """Evaluates what is constant, and takes everything else from ``baked``; leaves not in it are collected in ``wanted``."""

    def __init__(self, images, baked: dict[Leaf, Value]):
        super().__init__(images, set())
        self._plain = NodeReader(images, set())
        self._baked = baked
        self.wanted: list[Leaf] = []

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
        leaf = Leaf(tuple(node.name for node in path), out.node.name, out.identifier, kind)
        if leaf not in self._baked and leaf not in self.wanted:
            self.wanted.append(leaf)
        return self._baked.get(leaf) or Value(np.ones(3, np.float32), _PLACEHOLDER, mapping=_MAPPING)


class BakedShaders(ShaderReader):
    """Reads closures by formula where there is one, else by their baked diffuse colour and emission."""

    def unknown(self, out, path: tuple) -> Surface:
        """A closure without a formula, as Cycles bakes it."""
        color = self._nodes.leaf(out, path, "DIFFUSE")
        return Surface(color, self._nodes.leaf(out, path, "EMIT"), base_color=color)


def wanted_leaves(images, material) -> list[Leaf]:
    """Every socket that must be baked before the material can be read."""
    nodes = BakedNodes(images, {})
    BakedShaders(nodes).surface(material)
    return nodes.wanted


def bake_leaves(request, leaves: dict[int, list[Leaf]], scene) -> tuple[dict[int, dict[Leaf, Value]], np.ndarray | None]:
    """Bake the leaves of each slot of a request; returns the values by slot and the (loops, 2) UV map of their textures.

    Without a UV map the values are 1-row textures whose column is the loop index. Raises BakeError if Cycles cannot bake.
    """
    _require_cycles(request.name)
    polygons = _polygons_of(request, leaves)
    uv = None
    count = np.count_nonzero(polygons)
    resolution = next((side for most, side in RESOLUTIONS.items() if count <= most), 0)
    if resolution and len(request.mesh.uv_layers) < _MOST_UV_MAPS:
        uv = _unwrapped(request, polygons, resolution)
    with _Stage(request, scene, uv, resolution) as stage:
        copies = {slot: stage.copy_of(slot) for slot in leaves}
        result = {slot: {} for slot in leaves}
        for kind in ("EMIT", "DIFFUSE"):
            queues = {slot: [leaf for leaf in wanted if leaf.kind == kind] for slot, wanted in leaves.items()}
            for turn in range(max(map(len, queues.values()), default=0)):
                active = {slot: queue[turn] for slot, queue in queues.items() if turn < len(queue)}
                for slot, leaf in active.items():
                    stage.expose(copies[slot], leaf)
                stage.bake(kind)
                for slot, leaf in active.items():
                    result[slot][leaf] = stage.result(slot, f"{request.materials[slot].name}: {leaf.node}")
    return result, uv


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
        self._object.matrix_world = self._request.world_from_local
        self._object.color, self._object.pass_index = self._request.color, self._request.pass_index
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
        image = self._own(bpy.data.images, bpy.data.images.new("rtgi bake", side, side, alpha=True, float_buffer=True))
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
        self._images[slot] = image

    def copy_of(self, slot: int):
        """A copy of a slot's material, put in that slot, that ``expose`` may rewire."""
        copy = self._own(bpy.data.materials, self._request.materials[slot].copy())
        self._add_target(copy, slot, self._resolution)
        self._request.mesh.materials[slot] = copy
        return copy

    def expose(self, material, leaf: Leaf) -> None:
        """Wire a leaf to the material's output, through the groups around it."""
        tree = material.node_tree
        out = self._lifted(tree, leaf.path, leaf.node, leaf.socket)
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

    def _lifted(self, tree, path: tuple[str, ...], node: str, socket: str):
        """The output socket, in ``tree``, that carries a socket from within nested groups (which are copied to be changed)."""
        if not path:
            return next(out for out in tree.nodes[node].outputs if out.identifier == socket)
        group = tree.nodes[path[0]]
        group.node_tree = inner = self._own(bpy.data.node_groups, group.node_tree.copy())
        out = self._lifted(inner, path[1:], node, socket)
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

    def result(self, slot: int, name: str) -> Value:
        """What the last bake left for a slot; constant if it is the same everywhere."""
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
        seen = pixels[filled][:, :3]
        if len(seen) and np.ptp(seen, axis=0).max() <= 1e-5 * max(1.0, float(np.abs(seen).max())):
            return Value.of(seen.mean(axis=0, dtype=np.float64))
        rgb = pixels[..., :3].copy() if self._uv is None else filled_in(pixels[..., :3], filled)
        return Value(np.ones(3, np.float32), ComputedTexture(name, rgb, False, "EXTEND"), mapping=_MAPPING)


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
