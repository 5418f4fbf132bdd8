"""bpy images as textures: packed, external, generated, byte and float; each read once."""

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

from ...errors import BakeError
from ...machine.memory import available_bytes
from ...numerics.colour import linear_from_srgb, srgb_from_linear
from ...scene import Texture
from ...scene.memory import shortage
from ..colour import working_from_rec709

# Diffuse light transport sees nothing finer: larger images are averaged down to this (in linear light) to bound memory.
MAXIMUM_SIDE = 2048
# A number of an image as it is read, decoded and averaged, in floats.
BYTES_PER_NUMBER = 14
# Numbers of an image from which its memory is asked for before it is read.
ASK_FROM = 1 << 20
# What Cycles shows in place of an image it cannot find.
MISSING_COLOR = (1.0, 0.0, 1.0)
# Colour spaces whose bytes are scene-linear Rec.709 as they are.
LINEAR_SPACES = ("Linear", "Linear Rec.709")


def is_missing(image) -> bool:
    """True if the image's file cannot be read."""
    return image.size[0] == 0 or image.size[1] == 0 or (not image.has_data and len(image.pixels) == 0)


def _is_for_cycles(image) -> bool:
    """True if Blender does not hand out the pixels that Cycles takes from the file: layers of an EXR, and 8-bit colour that is
    premultiplied, which Blender divides by its alpha and clips."""
    if is_missing(image):
        path = bpy.path.abspath(image.filepath, library=image.library)
        return image.packed_file is not None or (bool(image.filepath) and Path(path).is_file())
    if image.is_float or image.alpha_mode != "PREMUL" or image.channels != 4 or image.source == "GENERATED":
        return False
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return bool(np.any(pixels[3::4] < 1.0))


class ImageCache:
    """Textures by image and the way they are used; ``notes`` receives lines about reduced images, ``missing`` (None: ``notes``
    too) is called with one whenever an image is asked for that is not there."""

    def __init__(self, notes: list[str], missing: Callable[[str], None] | None = None):
        self._notes, self._missing = notes, missing or self._note
        self._working = working_from_rec709()
        self._for_cycles: dict[str, bool] = {}
        self._pixels: dict[tuple, tuple[np.ndarray, bool]] = {}
        self._textures: dict[tuple, Texture] = {}

    def is_for_cycles(self, image) -> bool:
        """True if Cycles alone can say what the image shows: see ``_is_for_cycles``."""
        if image.name_full not in self._for_cycles:
            self._for_cycles[image.name_full] = _is_for_cycles(image)
        return self._for_cycles[image.name_full]

    def texture(self, image, extension: str, interpolation: str, with_alpha: bool) -> Texture:
        """The texture of an image; ``with_alpha`` says that its alpha output is in use.

        Cycles filters premultiplied colour: without the alpha output the colour stays premultiplied, with it it is straight.
        """
        key = (image.name_full, extension, interpolation, with_alpha)
        if is_missing(image):
            path = bpy.path.abspath(image.filepath, library=image.library) if image.filepath else "no file path"
            self._missing(f"image '{image.name}' is missing ({path}): magenta, as in Cycles")
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
            return np.array([[MISSING_COLOR]], np.float32), False
        width, height = image.size
        _require_memory(image, width * height * image.channels)
        stored = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(stored)
        stored = stored.reshape(height, width, image.channels)
        space = image.colorspace_settings
        srgb = not (image.is_float or space.is_data or space.name in LINEAR_SPACES)
        pixels = self._reduced(image, stored, srgb)
        pixels, srgb = _with_alpha_applied(image, pixels, srgb, with_alpha)
        # Floats are scene-linear as Blender hands them out; bytes are as the file has them.
        if self._working is None or image.is_float or space.is_data or pixels.shape[2] < 3:
            return pixels, srgb
        return _into_working_space(pixels, srgb, self._working), False

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

    def _note(self, line: str) -> None:
        if line not in self._notes:
            self._notes.append(line)


def _into_working_space(pixels: np.ndarray, srgb: bool, working: np.ndarray) -> np.ndarray:
    """Bytes (h, w, c ≥ 3) of Rec.709, coded if ``srgb``, as linear half floats of the working space: so does Cycles filter them."""
    result = pixels.astype(np.float32) / np.float32(255.0 if pixels.dtype == np.uint8 else 1.0)
    color = linear_from_srgb(result[..., :3]) if srgb else result[..., :3]
    result[..., :3] = color @ working.T
    return result.astype(np.float16)


def _require_memory(image, numbers: int) -> None:
    """Raise BakeError if there is too little for the image of so many ``numbers``, before it is read."""
    # Asking the system takes about as long as reading a small image, and one of a few MiB is not what a machine runs out over:
    # the scene's own check counts all of them together.
    if numbers < ASK_FROM:
        return
    found = shortage({"textures": BYTES_PER_NUMBER * numbers}, available_bytes())
    if found is not None:
        raise BakeError(f"the image '{image.name}' of {image.size[0]} × {image.size[1]} texels {found[0]}", found[1])


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
