"""The whole extraction, in two phases: read evaluated data while it lives, then what takes Blender operators."""

from dataclasses import replace
from pathlib import Path

import bpy

from ...errors import BakeError
from ...scene import Omissions, Scene
from ...techniques.lattice.fit import bounds_of, describe, fit_volume
from .. import remembered
from ..colour import REC709, working_space
from ..materials import MaterialReader
from ..ui.role_properties import is_left_out
from .cameras import read_camera
from .instances import GeometryCollector
from .lamp_profiles import request_of, with_profile
from .lamps import linked, read_lamp
from .linking import read_links
from .media import MediaCollector
from .points import PointCollector
from .render_depsgraph import read_for_render
from .roles import collections_of_objects
from .spheres import is_sphere, read_sphere
from .unresolved import note_unresolved, require_files
from .volumes import is_volume, read_volume, select_volumes
from .world import read_mist, read_world

# How many objects are read from one step of progress to the next.
_OBJECTS_A_STEP = 256


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
    where there is nothing to fit a volume to and for a pipe or a device in the place of a file, Cancelled.
    """
    context = context or bpy.context
    scene = depsgraph.scene.original if depsgraph is not None else context.scene
    require_files()
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
        self._omissions = Omissions()
        self._lights, self._volumes, self._cameras, self._spheres = [], [], [], []
        self._points = PointCollector(collections_of_objects())
        # Objects that volumes are not meant to see.
        self._unscattered: list[str] = []
        self._world = scene.world
        self._geometry = self._materials = self._media = None

    def read(self, depsgraph) -> None:
        """Phase one: everything that lives only as long as the dependency graph."""
        self._materials = MaterialReader(self._scene, depsgraph, self._omissions)
        note_unresolved(self._scene, depsgraph.view_layer, self._omissions)
        layer = depsgraph.view_layer_eval
        self._geometry = GeometryCollector(self._scene, self._materials, self._omissions, layer.material_override)
        self._media = MediaCollector(self._scene, self._omissions, self._notes)
        if layer.world_override is not None:
            self._world = layer.world_override.original
        active = depsgraph.scene.camera
        if active is not None and not active.original.hide_render:
            self._add_camera(active, depsgraph)
        in_viewport = depsgraph.mode == "VIEWPORT"
        for count, item in enumerate(depsgraph.object_instances):
            if self._progress is not None and count % _OBJECTS_A_STEP == 0:
                self._progress.step(0.0, f"reading object {count}")
            obj = item.object
            if not is_shown(item, in_viewport):
                continue
            if obj.type == "LIGHT":
                light = read_lamp(obj, item.matrix_world, self._notes)
                if light is not None:
                    frame_number = self._scene.frame_current, self._scene.frame_subframe
                    self._lights.append((light, read_links(obj), request_of(obj, item.matrix_world, frame_number)))
            elif obj.type == "VOLUME":
                self._media.add_volume(item)
            elif is_volume(obj):
                self._volumes.append(read_volume(obj, item.matrix_world))
            elif is_sphere(obj):
                self._spheres.append(read_sphere(obj, item.matrix_world))
            elif obj.type == "EMPTY":
                self._points.add(item)
            elif obj.type == "CAMERA":
                if not item.is_instance and (active is None or obj.original != active.original):
                    self._add_camera(obj, depsgraph)
            else:
                if not obj.visible_volume_scatter:
                    self._unscattered.append(obj.name)
                self._geometry.add(item)

    def finish(self) -> Scene:
        """Phase two: bakes and renders that materials and world need, then the frozen scene."""
        with self._materials:
            meshes, instances, materials = self._geometry.finish(self._progress)
        lights = self._finished_lights(self._geometry.identities)
        world = read_world(self._world, self._notes)
        box = bounds_of(meshes, instances, [camera.world_from_camera[:3, 3] for camera in self._cameras], self._volumes)
        media = self._media.finish(self._world, self._geometry.filled(), box)
        if any(max(medium.scattering) > 0 for medium in media):
            self._remark_on_scattering(lights)
            self._geometry.omit_scattered_alone()
        if working_space() != REC709:
            self._notes.append(f"the file's working colour space is {working_space()}: all numbers of the bake are in it")
        volumes = select_volumes(self._volumes, self._volume_names)
        scene = Scene(self._scene.name, meshes, instances, materials, lights, world, tuple(volumes),
                      tuple(self._cameras), tuple(dict.fromkeys([*self._notes, *self._materials.notes])), self._omissions.all(),
                      bpy.data.filepath, bpy.app.version_string, read_mist(self._world), files_of_blend(), media,
                      tuple(self._spheres), self._points.points())
        if volumes:
            return scene
        self._require_geometry(meshes)
        fitted = fit_volume(scene)
        return replace(scene, volumes=(fitted,), notes=(describe(fitted), *scene.notes))

    def _finished_lights(self, identities) -> tuple:
        """The lamps with what their nodes and their links make of their light."""
        found = ((light if request is None else with_profile(light, request, self._omissions), links)
                 for light, links, request in self._lights)
        return tuple(linked(light, links, identities) for light, links in found if light is not None)

    def _remark_on_scattering(self, lights) -> None:
        """What of ray visibility and influence on volumes is not as Cycles has it."""
        for name in dict.fromkeys(self._unscattered):
            self._notes.append(f"{name} is hidden from volume scatter rays: bakes and rays from media follow that, and what "
                               "pictures take from probes for their media does not")
        for light in lights:
            if light.scattered not in (0.0, 1.0):
                self._notes.append(f"lamp {light.name}: its influence on volumes, {light.scattered:g}, is followed, which Cycles "
                                   "does not do")

    def _require_geometry(self, meshes) -> None:
        """Where nothing is there to fit a volume to because it is missing, say what is missing."""
        missing = next((omission for omission in self._omissions.all() if omission.remedy), None)
        if missing is not None and not meshes:
            raise BakeError(missing.text, missing.remedy)

    def _add_camera(self, obj, depsgraph):
        camera = read_camera(obj, depsgraph, self._scene.render, self._notes)
        if camera is not None:
            self._cameras.append(camera)


def files_of_blend() -> tuple[str, ...]:
    """The paths of the open file and of every file that it takes something from: libraries, images, caches."""
    paths = {bpy.data.filepath, *bpy.utils.blend_paths(absolute=True)}
    # A volume without a file has "" as its path, which saving makes relative: to the root of all files.
    return tuple(sorted(path for path in paths if Path(path).name))


def is_shown(item, in_viewport: bool) -> bool:
    """True if a ``DepsgraphObjectInstance`` is part of the picture, and the user has not left it out; ``in_viewport`` says whose
    dependency graph it comes from."""
    if not item.show_self or is_left_out(item.object) or (item.parent is not None and is_left_out(item.parent)):
        return False
    hidden = item.object.hide_render or (item.parent is not None and item.parent.hide_render)
    return not (in_viewport and hidden)
