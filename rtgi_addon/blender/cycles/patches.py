"""Cycles as the judge of a reading: irradiance on small white patches that hang in the open scene.

The patches are one mesh, and Cycles bakes what falls on it (its DIFFUSE bake, direct and indirect, without colour): so shaders are
asked by diffuse and shadow rays, as they are wherever a bake's light falls, and neither a camera nor OSL is needed. Every patch
has a tile of texels of its own; their spread is the noise.

A bake does not see the medium that it lies in. Where there are media a camera looks straight down at every patch from as close as
can be: its rays know in which media they begin, and find π-th parts of the same irradiance. It is written in OSL; without that no
patch is to lie within a medium.
"""

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...errors import BakeError
from ...evaluate.references import Truth
from ...evaluate.verify import Places, Suspect
from ...numerics.sampling import frame
from ...progress import Progress
from ..worker import main_thread
from .changes import changed
from .receivers import aim
from .reference import CAMERA_BEGINS, CAMERA_ENDS, CyclesSettings, render_picture, rendering

# Side of a patch's tile [texels], and paths from each texel.
TILE, SAMPLES = 4, 64
# How far above its patch a camera's rays begin, and how much of its side they cover.
_LIFT, _COVERED = 0.05, 0.9
_PATCH_CAMERA = CAMERA_BEGINS + """
    int f = 9 * place;
    /* Cycles' camera space is Blender's with Z reversed. */
    vector facing = vector(frames[f + 6], frames[f + 7], -frames[f + 8]);
    vector aside = u * vector(frames[f], frames[f + 1], -frames[f + 2]) + v * vector(frames[f + 3], frames[f + 4], -frames[f + 5]);
    position += {lift} * facing + {half} * aside;
    direction = -facing;
""" + CAMERA_ENDS
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


class CyclesPatches:
    """See evaluate.verify.Judge. Renders on Blender's main thread, wherever it is asked from, ``scene`` in ``view_layer`` (None:
    the context's), which was read as ``extracted``."""

    kind = "Cycles"

    def __init__(self, extracted, samples: int = SAMPLES, threads: int | None = None, scene=None, view_layer=None, seed: int = 0):
        self._extracted, self._samples, self._threads, self._seed = extracted, samples, threads, seed
        self._scene = scene or bpy.context.scene
        self._layer = view_layer or bpy.context.view_layer
        if self._layer.material_override is not None:
            raise BakeError(f"view layer {self._layer.name!r} overrides all materials, those of the verification's patches too",
                            "clear its material override, or choose another view layer")

    @property
    def sees_media(self) -> bool:
        """See Judge."""
        return bool(bpy.app.build_options.cycles_osl)

    def irradiance(self, places: Places, without: tuple[Suspect, ...], progress: Progress) -> Truth:
        """See Judge."""
        progress.step(0.0, "Cycles at surfaces and probes")
        return main_thread.call(progress, self._irradiance, places, without)

    def _irradiance(self, places: Places, without: tuple[Suspect, ...]) -> Truth:
        count = len(places.points)
        columns = int(np.ceil(np.sqrt(count)))
        rows = -(-count // columns)
        settings = CyclesSettings(samples=self._samples, threads=self._threads)
        with ExitStack() as stack:
            stack.enter_context(changed(self._scene, self._extracted, without))
            camera = stack.enter_context(rendering(self._scene, settings))
            self._scene.cycles.seed = self._seed
            patches = stack.enter_context(_patches(self._scene, places, columns, rows))
            if self._extracted.media and self.sees_media:
                stack.enter_context(_alone(self._scene, self._layer))
                pixels = _seen(self._scene, camera, places)
            else:
                pixels = _baked(self._scene, self._layer, *patches)
        tiles = pixels.reshape(rows, TILE, columns, TILE, -1)[..., :3].transpose(0, 2, 1, 3, 4).reshape(-1, TILE * TILE, 3)[:count]
        tiles = np.pi * tiles.astype(np.float64)
        return Truth(tiles.mean(axis=1), tiles.var(axis=1, ddof=1) / tiles.shape[1])


@contextmanager
def _alone(scene, layer) -> Iterator[None]:
    """Render ``layer`` of ``scene`` and no other."""
    before = [(other, other.use) for other in scene.view_layers]
    try:
        for other, _ in before:
            other.use = other.name == layer.name
        yield
    finally:
        for other, use in before:
            other.use = use


def _seen(scene, camera, places: Places) -> np.ndarray:
    """What ``camera`` sees of the patches, row 0 at the bottom: irradiance over π."""
    with tempfile.TemporaryDirectory() as name:
        aim(camera, scene, _PATCH_CAMERA, places.points, places.normals, TILE, Path(name), lift=repr(_LIFT * places.side),
            half=repr(0.5 * _COVERED * places.side))
        return render_picture(scene, Path(name))


@contextmanager
def _patches(scene, places: Places, columns: int, rows: int) -> Iterator[tuple]:
    """The patches as an object of ``scene``, and the image that their light is baked into; both are gone afterwards."""
    count = len(places.points)
    made = []

    def own(collection, block):
        made.append((collection, block))
        return block

    try:
        mesh = own(bpy.data.meshes, bpy.data.meshes.new("RTGI patches"))
        tangent, bitangent = frame(places.normals)
        offset = _CORNERS - 0.5
        corners = places.points[:, None] + places.side * (offset[:, :1] * tangent[:, None] + offset[:, 1:] * bitangent[:, None])
        mesh.from_pydata(corners.reshape(-1, 3).tolist(), [], np.arange(4 * count).reshape(-1, 4).tolist())
        cell = np.stack([np.arange(count) % columns, np.arange(count) // columns], axis=1)
        uv = (cell[:, None] + _CORNERS) / (columns, rows)
        mesh.uv_layers.new(name="tiles").uv.foreach_set("vector", uv.astype(np.float32).ravel())
        image = own(bpy.data.images, bpy.data.images.new("RTGI patches", columns * TILE, rows * TILE, float_buffer=True))
        image.colorspace_settings.name = "Non-Color"
        mesh.materials.append(_white(own, image))
        obj = own(bpy.data.objects, bpy.data.objects.new("RTGI patches", mesh))
        scene.collection.objects.link(obj)
        _lit_by_all(obj)
        yield obj, image
    finally:
        for collection, block in reversed(made):
            collection.remove(block)


def _lit_by_all(obj) -> None:
    """Let lights that are linked to some objects light ``obj`` too: what a bake stores is for anybody. It leaves their collections
    when it is removed."""
    owners = (other for other in bpy.data.objects if getattr(other, "light_linking", None) is not None)
    for collection in {owner.light_linking.receiver_collection for owner in owners} - {None}:
        members = [*collection.collection_objects, *collection.collection_children]
        # Where nothing is included, everything is but what is excluded.
        if any(member.light_linking.link_state == "INCLUDE" for member in members):
            collection.objects.link(obj)


def _white(own, image):
    material = own(bpy.data.materials, bpy.data.materials.new("RTGI patches"))
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, diffuse, target = (tree.nodes.new(name) for name in ("ShaderNodeOutputMaterial", "ShaderNodeBsdfDiffuse",
                                                                  "ShaderNodeTexImage"))
    diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    target.image = image
    tree.nodes.active = target
    return material


def _baked(scene, layer, obj, image) -> np.ndarray:
    """What Cycles bakes into ``image``, row 0 at the bottom, of irradiance over π."""
    layer.update()
    selected = [other for other in layer.objects if other.select_get(view_layer=layer)]
    active = layer.objects.active
    context = {"scene": scene, "view_layer": layer, "object": obj, "active_object": obj, "selected_objects": [obj],
               "selected_editable_objects": [obj]}
    try:
        obj.select_set(True, view_layer=layer)
        with bpy.context.temp_override(**context):
            bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, target="IMAGE_TEXTURES", uv_layer="tiles",
                                margin=0, use_clear=True, use_selected_to_active=False)
    except RuntimeError as error:
        raise BakeError(f"Cycles could not render the patches of the verification ({str(error).strip()})",
                        "let a running render finish, then verify again") from error
    finally:
        for other in selected:
            other.select_set(True, view_layer=layer)
        layer.objects.active = active
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, -1)
