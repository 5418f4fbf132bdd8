"""The whole extraction, in two phases: read evaluated data while it lives, then what takes Blender operators."""

import bpy

from ...scene import Scene
from .. import remembered
from ..materials import MaterialReader
from .cameras import read_camera
from .instances import GeometryCollector
from .lamps import read_lamp
from .render_depsgraph import read_for_render
from .volumes import describe, fit_volume, is_volume, read_volume, select_volumes
from .world import read_world


def extract_scene(depsgraph=None, *, context=None, volumes: list[str] | None = None, progress=None, reuse: bool = False) -> Scene:
    """The scene of ``context`` (default: the current one) as plain arrays that outlive the file. Main thread only.

    Without a ``depsgraph`` the scene is evaluated exactly as for F12: render subdivision levels, modifiers enabled for render,
    objects and collections visible in render. With one, that graph is read as it is: inside a RenderEngine it is its own;
    the viewport's has the viewport's levels, modifiers and visibility, less objects hidden from render. While Blender renders,
    worlds and materials that take a Cycles render of their own raise BakeError.

    Lengths stay in Blender units. The scene's unit scale only changes the numbers that Blender's interface shows: Cycles measures
    the distance to a lamp in Blender units whatever it is, and so does the bake.

    ``volumes`` names the Light Probe Volumes to bake (None: every visible one; with none in the file one is fitted, and
    ``Scene.notes`` says so). ``progress`` is a ``rtgi_addon.progress.Progress``. With ``reuse``, worlds and materials that
    only Cycles understands are what it made of them last (see `remembered`). Raises UsageError for an unknown volume, BakeError
    where there is nothing to fit a volume to, Cancelled.
    """
    context = context or bpy.context
    scene = depsgraph.scene.original if depsgraph is not None else context.scene
    reading = _Reading(scene, volumes, progress)
    if depsgraph is not None:
        reading.read(depsgraph)
    else:
        view_layer = context.view_layer
        if view_layer is None or scene.view_layers.get(view_layer.name) != view_layer:
            view_layer = scene.view_layers[0]
        read_for_render(scene, view_layer, reading.read)
    with remembered.reuse(reuse):
        return reading.finish()


class _Reading:
    """What is known of a scene between the two phases."""

    def __init__(self, scene, volume_names, progress):
        self._scene, self._volume_names, self._progress = scene, volume_names, progress
        self._notes: list[str] = []
        self._lights, self._volumes, self._cameras = [], [], []
        self._world = scene.world
        self._geometry = self._materials = None

    def read(self, depsgraph) -> None:
        """Phase one: everything that lives only as long as the dependency graph."""
        self._materials = MaterialReader(self._scene, depsgraph)
        layer = depsgraph.view_layer_eval
        self._geometry = GeometryCollector(self._materials, layer.material_override)
        if layer.world_override is not None:
            self._world = layer.world_override.original
        active = depsgraph.scene.camera
        if active is not None and not active.original.hide_render:
            self._add_camera(active, depsgraph)
        in_viewport = depsgraph.mode == "VIEWPORT"
        for count, item in enumerate(depsgraph.object_instances):
            if self._progress is not None and count % 256 == 0:
                self._progress.step(0.0, f"reading object {count}")
            obj = item.object
            if not is_shown(item, in_viewport):
                continue
            if obj.type == "LIGHT":
                light = read_lamp(obj, item.matrix_world, self._notes)
                if light is not None:
                    self._lights.append(light)
            elif is_volume(obj):
                self._volumes.append(read_volume(obj, item.matrix_world))
            elif obj.type == "CAMERA":
                if not item.is_instance and (active is None or obj.original != active.original):
                    self._add_camera(obj, depsgraph)
            else:
                self._geometry.add(item)

    def finish(self) -> Scene:
        """Phase two: bakes and renders that materials and world need, then the frozen scene."""
        with self._materials:
            meshes, instances, materials = self._geometry.finish(self._progress)
        world = read_world(self._world, self._notes)
        volumes = select_volumes(self._volumes, self._volume_names)
        if not volumes:
            volumes = [fit_volume(meshes, instances, self._scene.name)]
            self._notes.append(describe(volumes[0]))
        return Scene(self._scene.name, meshes, instances, materials, tuple(self._lights), world, tuple(volumes),
                     tuple(self._cameras), tuple(dict.fromkeys([*self._notes, *self._geometry.notes, *self._materials.notes])),
                     bpy.data.filepath, bpy.app.version_string)

    def _add_camera(self, obj, depsgraph):
        camera = read_camera(obj, depsgraph, self._scene.render, self._notes)
        if camera is not None:
            self._cameras.append(camera)


def is_shown(item, in_viewport: bool) -> bool:
    """True if a ``DepsgraphObjectInstance`` is part of the picture; ``in_viewport`` says whose dependency graph it comes from."""
    if not item.show_self:
        return False
    hidden = item.object.hide_render or (item.parent is not None and item.parent.hide_render)
    return not (in_viewport and hidden)
