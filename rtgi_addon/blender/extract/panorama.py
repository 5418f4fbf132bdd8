"""Any world as an equirectangular map: a small Cycles panorama of it alone, as a diffuse ray sees it."""

import bpy
import numpy as np

from ..materials.answered import answer
from ..materials.circumstances import Ray
from .small_renders import add_camera, owned, rendered, small_scene

# Who asks the world through the Light Path node: worlds often show the camera something else.
_ASKING = Ray("diffuse", length=1e5)
_SAMPLES = 4
# Texels this much brighter than the mean share this many samples among them.
_BRIGHT, _BRIGHT_SAMPLES = 16.0, 4_000_000
# And no texel takes more than this.
_MOST_SAMPLES = 8192


def render_panorama(world, width: int = 1024) -> np.ndarray:
    """Radiance (width/2, width, 3) float32 of ``world`` in ``scene.World.equirect``'s layout.

    Each texel averages its own square of directions: four samples first, thousands around texels far brighter than the rest, so
    that a sun disc two texels wide keeps its energy to about 0.1 %. Everything made for it is removed again. Raises
    BakeError where Cycles cannot render.
    """
    with small_scene("rtgi world", f"the world {world.name!r}") as (scene, made):
        copy = owned(made, bpy.data.worlds, world.copy())
        answer(copy.node_tree, _ASKING, (), made)
        _without_medium(copy.node_tree)
        if not copy.cycles_visibility.camera:
            copy.cycles_visibility.camera = True
        copy.cycles.sampling_method = "NONE"  # nothing here is lit: spare Cycles the importance map
        # Blender's cameras look along −Z with +Y up, its panoramas put their middle where the camera looks: turn it to +X, +Z up.
        add_camera(scene, made, "PANO").rotation_euler = (np.pi / 2.0, 0.0, -np.pi / 2.0)
        scene.world = copy
        render = scene.render
        render.resolution_x, render.resolution_y = width, width // 2
        equirect = rendered(scene, _SAMPLES)
        box = _bright_box(equirect)
        if box is not None:
            rows, columns = box
            render.use_border, render.use_crop_to_border = True, False
            render.border_min_y, render.border_max_y = rows.start * 2 / width, rows.stop * 2 / width
            render.border_min_x, render.border_max_x = columns.start / width, columns.stop / width
            texels = (rows.stop - rows.start) * (columns.stop - columns.start)
            equirect[box] = rendered(scene, int(np.clip(_BRIGHT_SAMPLES // texels, _SAMPLES, _MOST_SAMPLES)))[box]
    return equirect


def _without_medium(tree) -> None:
    """Leave only what the world gives from infinitely far: its medium is followed by itself."""
    for link in list(tree.links):
        if link.to_node.bl_idname == "ShaderNodeOutputWorld" and link.to_socket.name == "Volume":
            tree.links.remove(link)


def _bright_box(equirect) -> tuple[slice, slice] | None:
    """The rows and columns around all texels far brighter than the mean, or None."""
    luminance = equirect.mean(axis=2)
    bright = luminance > _BRIGHT * np.mean(luminance)
    if not bright.any():
        return None
    height, width = luminance.shape
    rows, columns = np.flatnonzero(bright.any(axis=1)), np.flatnonzero(bright.any(axis=0))
    return (slice(max(rows[0] - 2, 0), min(rows[-1] + 3, height)), slice(max(columns[0] - 2, 0), min(columns[-1] + 3, width)))
