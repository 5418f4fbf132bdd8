"""bpy images as textures: packed, external, generated, byte and float; each read once."""

import bpy
import numpy as np

from ...scene import Texture
from .values import linear_from_srgb, srgb_from_linear

# Diffuse light transport sees nothing finer: larger images are averaged down to this (in linear light) to bound memory.
MAXIMUM_SIDE = 2048
# What Cycles shows in place of an image it cannot find.
MISSING_COLOR = (1.0, 0.0, 1.0)
# Colour spaces whose bytes are scene-linear Rec.709 as they are.
LINEAR_SPACES = ("Linear", "Linear Rec.709")


def is_missing(image) -> bool:
    """True if the image's file cannot be read."""
    return image.size[0] == 0 or image.size[1] == 0 or (not image.has_data and len(image.pixels) == 0)


class ImageCache:
    """Textures by image and the way they are used; ``notes`` receives lines about missing and reduced images."""

    def __init__(self, notes: list[str]):
        self._notes = notes
        self._pixels: dict[tuple, tuple[np.ndarray, bool]] = {}
        self._textures: dict[tuple, Texture] = {}

    def texture(self, image, extension: str, interpolation: str, with_alpha: bool) -> Texture:
        """The texture of an image; ``with_alpha`` says that its alpha output is in use.

        Cycles filters premultiplied colour: without the alpha output the colour stays premultiplied, with it it is straight.
        """
        key = (image.name_full, extension, interpolation, with_alpha)
        if key not in self._textures:
            pixels, srgb = self._read(image, with_alpha)
            self._textures[key] = Texture(image.name, pixels, srgb, extension, interpolation)
        return self._textures[key]

    def _read(self, image, with_alpha: bool) -> tuple[np.ndarray, bool]:
        key = (image.name_full, with_alpha)
        if key not in self._pixels:
            self._pixels[key] = self._load(image, with_alpha)
        return self._pixels[key]

    def _load(self, image, with_alpha: bool) -> tuple[np.ndarray, bool]:
        if is_missing(image):
            self._note_missing(image)
            return np.array([[MISSING_COLOR]], np.float32), False
        width, height = image.size
        stored = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(stored)
        stored = stored.reshape(height, width, image.channels)
        space = image.colorspace_settings
        srgb = not (image.is_float or space.is_data or space.name in LINEAR_SPACES)
        pixels = self._reduced(image, stored, srgb)
        return _with_alpha_applied(image, pixels, srgb, with_alpha)

    def _reduced(self, image, pixels: np.ndarray, srgb: bool) -> np.ndarray:
        """Average whole blocks of texels in linear light until no side exceeds ``MAXIMUM_SIDE``."""
        factor = -(-max(pixels.shape[:2]) // MAXIMUM_SIDE)
        if factor == 1:
            return pixels
        height, width = (max(side // factor, 1) for side in pixels.shape[:2])
        rows = np.arange(height + 1) * pixels.shape[0] // height
        columns = np.arange(width + 1) * pixels.shape[1] // width
        linear = pixels.copy()
        if srgb:
            linear[..., :3] = linear_from_srgb(pixels[..., :3])
        summed = np.add.reduceat(np.add.reduceat(linear, rows[:-1], axis=0), columns[:-1], axis=1)
        result = summed / (np.diff(rows)[:, None, None] * np.diff(columns)[None, :, None])
        if srgb:
            result[..., :3] = srgb_from_linear(result[..., :3])
        self._note(f"image '{image.name}' was averaged from {pixels.shape[1]}×{pixels.shape[0]} to {width}×{height} texels")
        return result.astype(np.float32)

    def _note_missing(self, image) -> None:
        path = bpy.path.abspath(image.filepath, library=image.library) if image.filepath else "no file path"
        self._note(f"image '{image.name}' is missing ({path}): magenta, as in Cycles")

    def _note(self, line: str) -> None:
        if line not in self._notes:
            self._notes.append(line)


def _with_alpha_applied(image, pixels: np.ndarray, srgb: bool, with_alpha: bool) -> tuple[np.ndarray, bool]:
    """Bring alpha to what Cycles samples (encoded colour is premultiplied as it is) and store 8-bit sources as bytes."""
    if pixels.shape[2] == 2:
        pixels = np.dstack([pixels[..., :1]] * 3 + [pixels[..., 1:]])
    if pixels.shape[2] == 4 and (image.alpha_mode == "NONE" or not np.any(pixels[..., 3] < 1.0)):
        pixels = pixels[..., :3]
    elif pixels.shape[2] == 4 and not image.colorspace_settings.is_data:
        color, alpha = pixels[..., :3], pixels[..., 3:]
        if image.alpha_mode == "STRAIGHT" and not with_alpha:
            color *= alpha
        elif image.alpha_mode == "PREMUL" and with_alpha:
            np.divide(color, alpha, out=color, where=alpha > 0.0)
    if not image.is_float and pixels.max() <= 1.0:
        return np.rint(np.maximum(pixels, 0.0) * 255.0).astype(np.uint8), srgb
    pixels = np.ascontiguousarray(pixels)
    if srgb:
        pixels[..., :3] = linear_from_srgb(pixels[..., :3])
    return pixels, False
