"""The values that flow along node links, as far as a ``Channel`` can hold them: constant × texture × attribute + offset."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from ...numerics.colour import linear_from_srgb, srgb_from_linear
from ...scene import Channel, Texture
from ..colour import luminance_weights

_LARGEST_HALF = float(np.finfo(np.float16).max)


class Unreadable(Exception):
    """Nodes that a ``Channel`` cannot hold. ``node`` names the one at fault, ``reason`` says what it does."""

    def __init__(self, node: str, reason: str):
        super().__init__(f"{node} ({reason})")
        self.node, self.reason = node, reason


@dataclass(frozen=True, eq=False)
class ComputedTexture(Texture):
    """Scene-linear float texels made here from other textures or by a bake. ``coded`` says that they come from images that are
    filtered coded (see ``Texture``), and so must be what becomes of them."""

    coded: bool = False


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
        first, second = _constant_last(self, other)
        if second.equals(0.0):
            return first
        if first.cut is None and second.is_constant:
            if first.is_constant:
                return Value.of(first.constant + second.constant)
            return replace(first, offset=_total(first.offset, second.constant))
        if first.cut is None and second.cut is None and _factors(first) == _factors(second):
            return replace(first, constant=first.constant + second.constant, offset=_total(first.offset, second.offset))
        return apply(np.add, first, second)

    __radd__ = __add__

    def __mul__(self, other) -> "Value":
        first, second = _constant_last(self, other)
        if second.is_constant:
            if first.is_constant:
                return Value.of(first.constant * second.constant)
            if second.equals(0.0):
                return Value.of(0.0)
            if second.equals(1.0):
                return first
            if first.cut is None:
                return replace(first, constant=first.constant * second.constant,
                               offset=None if first.offset is None else first.offset * second.constant)
        separable = all(value.cut is None and value.offset is None for value in (first, second))
        if separable and None in (first.texture, second.texture) and None in (first.attribute, second.attribute):
            textured = first if first.texture is not None else second
            return replace(textured, constant=first.constant * second.constant, attribute=first.attribute or second.attribute)
        return apply(np.multiply, first, second)

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
            return Value.of(float(self.constant @ luminance_weights()))
        grey = _is_grey(self.constant) and (self.offset is None or _is_grey(self.offset))
        if grey and self.attribute is None and (self.texture_channel != "rgb" or self.texture.pixels.shape[2] == 1):
            return self
        return apply(lambda x: np.repeat(x @ luminance_weights(), 3).reshape(x.shape), self)

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
    coded = any(value.texture.srgb or getattr(value.texture, "coded", False) for value in varying)
    texture = ComputedTexture(first.texture.name, pixels, False, first.texture.extension, first.texture.interpolation, coded)
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


def _constant_last(first, second) -> tuple[Value, Value]:
    """Both as Values; if only one of them is constant, that is the second."""
    first, second = Value.of(first), Value.of(second)
    return (second, first) if first.is_constant else (first, second)


def _total(first, second):
    """The sum of two offsets, each of which may be None."""
    if first is None or second is None:
        return first if second is None else second
    return first + second


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
    """A computed texture as small as its values allow, one channel where grey: sRGB bytes (rounding: at most 0.5 % of full scale)
    where it is to be filtered coded and lies within [0, 1], else linear half floats, or floats beyond their range. However many
    channels read it, there is one."""
    if not isinstance(texture, ComputedTexture):
        return texture
    if texture not in _compacted:
        _compacted[texture] = _compacted_anew(texture)
    return _compacted[texture]


_compacted: WeakKeyDictionary[ComputedTexture, Texture] = WeakKeyDictionary()


def _compacted_anew(texture: ComputedTexture) -> Texture:
    pixels = texture.pixels
    if np.array_equal(pixels[..., 0], pixels[..., 1]) and np.array_equal(pixels[..., 0], pixels[..., 2]):
        pixels = pixels[..., :1]
    low, high = float(pixels.min()), float(pixels.max())
    if texture.coded and low >= 0.0 and high <= 1.0:
        pixels = np.rint(srgb_from_linear(pixels) * 255.0).astype(np.uint8)
    elif max(-low, high) < _LARGEST_HALF:
        pixels = pixels.astype(np.float16)
    return Texture(texture.name, np.ascontiguousarray(pixels), pixels.dtype == np.uint8, texture.extension, texture.interpolation)
