"""Materials on the GPU: the members of their uniform buffer, and their images."""

from collections.abc import Iterable

import gpu
import numpy as np

from ..scene import Channel, Material, Scene, Texture
from ..transport.views.gbuffer import MOST_MATERIALS
from .programs import MATERIAL_INPUTS
from .textures import upload

_EXTENSIONS = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3}
_IDENTITY = np.eye(2, 3)


class Slots:
    """Which UV maps and attributes the ``inputs`` of ``material`` read on one mesh, in the order of the vertex attributes."""

    def __init__(self, material: Material, inputs: Iterable[str]):
        channels = [getattr(material, name) for name in inputs]
        self.uv_layers = list(dict.fromkeys(channel.uv_layer for channel in channels if channel.texture is not None))
        self.attributes = list(dict.fromkeys(channel.attribute for channel in channels if channel.attribute is not None))


def uniforms(material: Material, index: int, slots: Slots, inputs: Iterable[str], first_instance: int) -> dict:
    """Values of the struct MATERIAL for number ``index`` of the scene's materials and a draw whose instances begin at
    ``first_instance``."""
    count = len(MATERIAL_INPUTS)
    factor, addend, row_x, row_y = (np.zeros((count, 4), np.float32) for _ in range(4))
    source, filtering = np.full((count, 4), -1, np.int32), np.zeros((count, 4), np.int32)
    for name in inputs:
        row, channel = MATERIAL_INPUTS.index(name), getattr(material, name)
        factor[row, :3] = channel.constant
        addend[row, :3] = 0.0 if channel.offset is None else channel.offset
        row_x[row, :3], row_y[row, :3] = _IDENTITY if channel.uv_transform is None else channel.uv_transform
        source[row], filtering[row] = _source(channel, slots), _filtering(channel.texture)
    threshold = -1.0 if material.alpha_threshold is None else material.alpha_threshold
    return {"factor": factor, "addend": addend, "uv_row_x": row_x, "uv_row_y": row_y, "source": source, "filtering": filtering,
            "surface": (threshold, first_instance, 0.0 if material.is_opaque else 1.0, min(index, MOST_MATERIALS))}


def _source(channel: Channel, slots: Slots) -> tuple[int, int, int, int]:
    uv = -1 if channel.texture is None else slots.uv_layers.index(channel.uv_layer)
    component = -1 if channel.texture_channel == "rgb" else "rgba".index(channel.texture_channel)
    attribute = -1 if channel.attribute is None else slots.attributes.index(channel.attribute)
    return uv, component, attribute, 0


def _filtering(texture: Texture | None) -> tuple[int, int, int, int]:
    if texture is None:
        return 0, 0, 0, 0
    return _EXTENSIONS[texture.extension], int(texture.interpolation == "Closest"), int(texture.srgb), 0


class Images:
    """The scene's images as textures: RGBA8 from bytes, RGBA32F from floats and half floats, coded as they are stored."""

    def __init__(self):
        self._uploaded: dict[int, tuple[Texture, gpu.types.GPUTexture]] = {}
        self._white = upload(np.ones((1, 1, 4), np.float32))

    def get(self, texture: Texture | None) -> gpu.types.GPUTexture:
        """``texture`` on the GPU; a white texel for None."""
        if texture is None:
            return self._white
        if id(texture) not in self._uploaded:
            # Kept with the texture itself, so that its id stays its own.
            self._uploaded[id(texture)] = texture, _upload(texture)
        return self._uploaded[id(texture)][1]

    def keep(self, scene: Scene) -> None:
        """Let go of images that no material of ``scene`` reads."""
        used = {id(channel.texture) for material in scene.materials for channel in material.channels()}
        self._uploaded = {key: entry for key, entry in self._uploaded.items() if key in used}


def _upload(texture: Texture) -> gpu.types.GPUTexture:
    height, width, channels = texture.pixels.shape
    is_bytes = texture.pixels.dtype == np.uint8
    rgba = np.ones((height, width, 4), np.float32)
    if channels == 4:
        rgba[:] = texture.pixels
    else:
        rgba[..., :3] = texture.pixels
    if is_bytes:
        rgba[..., :channels if channels == 4 else 3] /= np.float32(255.0)
    return upload(rgba, "RGBA8" if is_bytes else "RGBA32F", f"the image {texture.name!r}")
