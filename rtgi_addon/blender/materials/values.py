"""The values that flow along node links, as far as a ``Channel`` can hold them: constant × texture × attribute + offset."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...scene import Channel, Texture

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec.709, as Blender turns a colour into a number


class Unreadable(Exception):
    """Nodes that a ``Channel`` cannot hold. ``node`` names the one at fault, ``reason`` says what it does."""

    def __init__(self, node: str, reason: str):
        super().__init__(f"{node} ({reason})")
        self.node, self.reason = node, reason


class ComputedTexture(Texture):
    """Float texels made here from other textures or by a bake: stored as bytes in the end where their range allows."""


@dataclass(frozen=True)
class Mapping:
    """How a texture is placed: UV map (None = active for render), the six numbers of its 2×3 affine map (None = identity)."""

    uv_layer: str | None = None
    transform: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False)
class Value:
    """``constant`` (3,) × texture × attribute + ``offset`` (3,), scene-linear.

    ``cut`` (threshold, above) turns the whole into 1 where it is greater than (``above``) or less than the threshold, else 0.
    """

    constant: np.ndarray
    texture: Texture | None = None
    texture_channel: str = "rgb"
    mapping: Mapping = Mapping()
    attribute: str | None = None
    offset: np.ndarray | None = None
    cut: tuple[float, bool] | None = None

    __array_ufunc__ = None  # numpy operands must defer to the operators below

    @staticmethod
    def of(value) -> "Value":
        """A constant from a number, an RGB triple, or a Value (returned as it is)."""
        if isinstance(value, Value):
            return value
        return Value(np.broadcast_to(np.asarray(value, np.float32), (3,)).copy())

    @property
    def is_constant(self) -> bool:
        """True if it does not vary over the surface."""
        return self.texture is None and self.attribute is None

    def equals(self, number: float) -> bool:
        """True if it is ``number`` everywhere."""
        return self.is_constant and bool(np.all(self.constant == number))

    def __add__(self, other) -> "Value":
        a, b = Value.of(self), Value.of(other)
        if a.is_constant:
            a, b = b, a
        if b.equals(0.0):
            return a
        if a.cut is None and b.is_constant:
            if a.is_constant:
                return Value.of(a.constant + b.constant)
            return replace(a, offset=_total(a.offset, b.constant))
        if a.cut is None and b.cut is None and _factors(a) == _factors(b):
            return replace(a, constant=a.constant + b.constant, offset=_total(a.offset, b.offset))
        return apply(np.add, a, b)

    __radd__ = __add__

    def __mul__(self, other) -> "Value":
        a, b = Value.of(self), Value.of(other)
        if a.is_constant:
            a, b = b, a
        if b.is_constant:
            if a.is_constant:
                return Value.of(a.constant * b.constant)
            if b.equals(0.0):
                return Value.of(0.0)
            if b.equals(1.0):
                return a
            if a.cut is None:
                return replace(a, constant=a.constant * b.constant, offset=None if a.offset is None else a.offset * b.constant)
        separable = a.cut is None and b.cut is None and a.offset is None and b.offset is None
        if separable and (a.texture is None or b.texture is None) and (a.attribute is None or b.attribute is None):
            textured = a if a.texture is not None else b
            return replace(textured, constant=a.constant * b.constant, attribute=a.attribute or b.attribute)
        return apply(np.multiply, a, b)

    __rmul__ = __mul__

    def __neg__(self) -> "Value":
        return self * -1.0

    def __sub__(self, other) -> "Value":
        other = Value.of(other)
        if other.cut is not None and self.equals(1.0):
            return replace(other, cut=(other.cut[0], not other.cut[1]))
        return self + -other

    def __rsub__(self, other) -> "Value":
        return Value.of(other) - self

    def greater_than(self, threshold: float, above: bool = True) -> "Value":
        """1 where the value is above ``threshold`` (below it if not ``above``), else 0."""
        if self.is_constant or self.cut is not None:
            return apply(lambda x: ((x > threshold) if above else (x < threshold)).astype(np.float32), self)
        return replace(self, cut=(float(threshold), above))

    def clamped(self, low: float = 0.0, high: float = 1.0) -> "Value":
        """The value held within a range; nothing is done where its texture cannot leave it."""
        if self.cut is not None and low <= 0.0 and high >= 1.0:
            return self
        if not self.is_constant and self.texture is not None and self.attribute is None and self.texture.pixels.dtype == np.uint8:
            offset = 0.0 if self.offset is None else self.offset
            ends = np.stack([np.zeros(3) + offset, self.constant + offset])
            if ends.min() >= low and ends.max() <= high:
                return self
        return apply(lambda x: np.clip(x, low, high), self)

    def luminance(self) -> "Value":
        """The number Blender makes of a colour."""
        if self.texture is None and self.attribute is None:
            return Value.of(float(self.constant @ LUMINANCE))
        grey = _is_grey(self.constant) and (self.offset is None or _is_grey(self.offset))
        if grey and self.attribute is None and (self.texture_channel != "rgb" or self.texture.pixels.shape[2] == 1):
            return self
        return apply(lambda x: np.repeat(x @ LUMINANCE, 3).reshape(x.shape), self)

    def component(self, index: int) -> "Value":
        """The red, green or blue component, repeated."""
        repeated = None if self.offset is None else np.full(3, self.offset[index], np.float32)
        if self.attribute is None and self.cut is None and self.texture_channel == "rgb":
            channel = "rgb"[index] if self.texture is not None and self.texture.pixels.shape[2] > 1 else "rgb"
            return replace(self, constant=np.full(3, self.constant[index], np.float32), texture_channel=channel, offset=repeated)
        return apply(lambda x: np.repeat(x[..., index], 3).reshape(x.shape), self)

    def mean(self) -> np.ndarray:
        """(3,) average over the texture; an attribute counts as 1."""
        if self.texture is None:
            return self.constant + (0.0 if self.offset is None else self.offset)
        return texels(replace(self, attribute=None)).reshape(-1, 3).mean(axis=0, dtype=np.float64).astype(np.float32)

    def channel(self) -> Channel:
        """As a material channel (``cut`` must have been dealt with)."""
        if self.is_constant:
            return Channel.of(self.constant)
        transform = self.mapping.transform
        return Channel(
            constant=self.constant, texture=_compact(self.texture), texture_channel=self.texture_channel,
            uv_layer=self.mapping.uv_layer, attribute=self.attribute, offset=self.offset,
            uv_transform=None if transform is None else np.array(transform, np.float32).reshape(2, 3),
        )


def apply(function: Callable, *values: Value) -> Value:
    """``function`` of values, elementwise on (..., 3) arrays.

    Constants fold. Textures that share one placement are combined texel by texel (the smaller repeated up to the larger), which
    differs from evaluating after filtering only between texels. Raises Unreadable where neither is possible.
    """
    values = tuple(Value.of(value) for value in values)
    varying = [value for value in values if not value.is_constant]
    if not varying:
        return Value.of(function(*(value.constant for value in values)))
    first = varying[0]
    for value in varying:
        if value.attribute is not None:
            raise Unreadable(f"attribute '{value.attribute}'", "combined with something other than one texture")
        if _placement(value) != _placement(first):
            raise Unreadable(f"images '{first.texture.name}' and '{value.texture.name}'", "combined though placed differently")
    height = max(value.texture.pixels.shape[0] for value in varying)
    width = max(value.texture.pixels.shape[1] for value in varying)
    arrays = [value.constant if value.is_constant else _resized(texels(value), height, width) for value in values]
    pixels = np.broadcast_to(np.asarray(function(*arrays), np.float32), (height, width, 3))
    texture = ComputedTexture(first.texture.name, pixels, False, first.texture.extension, first.texture.interpolation)
    return Value(np.ones(3, np.float32), texture, mapping=first.mapping)


def texels(value: Value) -> np.ndarray:
    """(height, width, 3) float32 scene-linear: a textured value at its texels."""
    pixels = value.texture.pixels
    alpha = value.texture_channel == "a"
    if value.texture_channel == "rgb":
        rgb = pixels[..., :3]
    else:
        rgb = pixels[..., min("rgba".index(value.texture_channel), pixels.shape[2] - 1)][..., None]
    if pixels.dtype == np.uint8:
        codes = np.arange(256, dtype=np.float32) / 255.0
        rgb = (linear_from_srgb(codes) if value.texture.srgb and not alpha else codes)[rgb]
    elif value.texture.srgb and not alpha:
        rgb = linear_from_srgb(rgb)
    result = rgb * value.constant + (np.float32(0.0) if value.offset is None else value.offset)
    if value.cut is not None:
        threshold, above = value.cut
        result = ((result > threshold) if above else (result < threshold)).astype(np.float32)
    return result


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Decode IEC 61966-2-1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """Encode IEC 61966-2-1."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055).astype(np.float32)


def _total(a, b):
    if a is None or b is None:
        return a if b is None else b
    return a + b


def _is_grey(color) -> bool:
    return bool(np.all(color == color[0]))


def _factors(value: Value):
    return id(value.texture), value.texture_channel, value.mapping, value.attribute


def _placement(value: Value):
    return value.mapping, value.texture.extension, value.texture.interpolation


def _resized(pixels: np.ndarray, height: int, width: int) -> np.ndarray:
    if pixels.shape[:2] == (height, width):
        return pixels
    rows = np.arange(height) * pixels.shape[0] // height
    columns = np.arange(width) * pixels.shape[1] // width
    return pixels[rows[:, None], columns]


def _compact(texture: Texture | None) -> Texture | None:
    """A computed texture within [0, 1] as sRGB-encoded bytes (rounding: at most 0.5 % of full scale), one channel where grey."""
    if not isinstance(texture, ComputedTexture):
        return texture
    pixels = texture.pixels
    if np.array_equal(pixels[..., 0], pixels[..., 1]) and np.array_equal(pixels[..., 0], pixels[..., 2]):
        pixels = pixels[..., :1]
    if pixels.min() < 0.0 or pixels.max() > 1.0:
        return Texture(texture.name, np.ascontiguousarray(pixels), False, texture.extension, texture.interpolation)
    codes = np.rint(srgb_from_linear(pixels) * 255.0).astype(np.uint8)
    return Texture(texture.name, codes, True, texture.extension, texture.interpolation)
