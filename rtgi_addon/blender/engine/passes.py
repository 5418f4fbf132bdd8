"""What a render delivers: Blender's names for the renderer's passes, and which of them a view layer asks for."""

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np


@dataclass(frozen=True)
class RenderPass:
    """``name`` and ``channels`` ('RGBA', 'RGB', 'XYZ', 'Z') as Blender shows them, ``kind`` how it treats the values, ``source``
    the renderer's pass; ``wanted`` tells whether a view layer asks for it."""

    name: str
    channels: str
    kind: str
    source: str
    wanted: Callable[[object], bool]


# As Cycles calls them.
_VOLUME = ("Volume Direct", "Volume Indirect") if bpy.app.version >= (5, 0, 0) else ("VolumeDir", "VolumeInd")

PASSES = (
    RenderPass("Combined", "RGBA", "COLOR", "combined", lambda layer: True),
    RenderPass("Depth", "Z", "VALUE", "depth", lambda layer: layer.use_pass_z),
    RenderPass("Normal", "XYZ", "VECTOR", "normal", lambda layer: layer.use_pass_normal),
    RenderPass("DiffCol", "RGB", "COLOR", "albedo", lambda layer: layer.use_pass_diffuse_color),
    RenderPass("Direct", "RGB", "COLOR", "direct", lambda layer: layer.rtgi.use_direct),
    RenderPass("Indirect", "RGB", "COLOR", "indirect", lambda layer: layer.rtgi.use_indirect),
    RenderPass("Irradiance", "RGB", "COLOR", "irradiance", lambda layer: layer.rtgi.use_irradiance),
    RenderPass(_VOLUME[0], "RGB", "COLOR", "volume_direct", lambda layer: layer.rtgi.use_volume_direct),
    RenderPass(_VOLUME[1], "RGB", "COLOR", "volume_indirect", lambda layer: layer.rtgi.use_volume_indirect),
    RenderPass("Mirror Confidence", "RGB", "COLOR", "mirror_confidence", lambda layer: layer.rtgi.use_mirror_confidence),
    RenderPass("Mirror Distance", "RGB", "COLOR", "mirror_distance", lambda layer: layer.rtgi.use_mirror_distance),
    RenderPass("Transmittance", "RGB", "COLOR", "transmittance", lambda layer: layer.rtgi.use_transmittance),
)
# Those that every engine's result has without being asked.
_BUILT_IN = {"Combined"}


def passes_of(layer) -> list[RenderPass]:
    """The passes that a view layer asks for."""
    return [entry for entry in PASSES if entry.wanted(layer)]


def register_passes(engine, scene, layer) -> None:
    """Tell Blender's compositor which sockets a view layer has (RenderEngine.update_render_passes)."""
    for entry in passes_of(layer):
        engine.register_pass(scene, layer, entry.name, len(entry.channels), entry.channels, entry.kind)


def add_passes(engine, layer) -> None:
    """Add the passes to the result that is about to begin."""
    for entry in passes_of(layer):
        if entry.name not in _BUILT_IN:
            engine.add_pass(entry.name, len(entry.channels), entry.channels, layer=layer.name)


def write_passes(result_layer, layer, images: Callable[[str], np.ndarray]) -> None:
    """Fill a begun result's layer from ``images``: pass name → (h, w, 4) float32, row 0 at the bottom."""
    for entry in passes_of(layer):
        pixels = images(entry.source)
        target = result_layer.passes.find_by_name(entry.name, "")
        target.rect.foreach_set(np.ascontiguousarray(pixels[..., :target.channels], np.float32).ravel())
