"""Surfaces in another style: bands and ramps of their irradiance, shadow colour, colour bleeding, highlights and rims.

Everything starts from irradiance, the lamps' and the field's, so that what stands around tints every tread. Sources: the lecture's
last chapter; rim light and ramps as in Mitchell, Francke and Eng, "Illustrative Rendering in Team Fortress 2", NPAR 2007.
"""

import numpy as np

from ...transport.vectors import dot, luminance
from ..frame import Frame
from ..mist import LEFT
from .ramps import look_up
from .tone import banded, pixel_change, smooth_step

_INVERSE_PI = np.float32(1.0 / np.pi)
# Steps of Newton's method that part a shine from what lies below: from below its root, which it never passes.
_STEPS = 5
_TINY = np.float32(1e-20)


def tones(frame: Frame, values: dict) -> tuple[np.ndarray, np.ndarray]:
    """Luminance of the irradiance over the key light's (h, w), and how much it changes over a pixel."""
    tone = (frame.direct[..., 3] + luminance(frame.irradiance)) / np.float32(values["key"])
    return tone, pixel_change(tone, frame.gbuffer.instance)


def changes_surfaces(values: dict) -> bool:
    """False if surfaces stay as they are lit."""
    return bool(values["shading"] != 0 or values["bleeding"] != 1.0 or values["highlights"] != 0 or values["shadow_amount"] > 0
                or values["rim_strength"] > 0)


def restyled(frame: Frame, values: dict, tone: np.ndarray, change: np.ndarray) -> np.ndarray:
    """The picture (h, w, 4) with its surfaces restyled: ``frame.light`` plus what they show otherwise than as they were lit, so
    that reflections and media of earlier effects stay. ``tone`` and ``change`` as ``tones`` gives them."""
    seen, gbuffer = frame.gbuffer.seen, frame.gbuffer
    albedo, direct, irradiance = gbuffer.albedo[seen][:, :3], frame.direct[seen], frame.irradiance[seen][:, :3]
    emission = gbuffer.emission[seen][:, :3]
    result = frame.light.copy()
    lit = direct[:, :3] + albedo * irradiance * _INVERSE_PI + emission
    if values["shading"] == 3:
        styled = np.broadcast_to(np.float32(values["paper_color"]), lit.shape)
    else:
        colour, shine = _parted(albedo, direct)
        total = colour * direct[:, 3:] + saturated(irradiance, values["bleeding"])
        styled = albedo * _INVERSE_PI * shaded(total, tone[seen], change[seen], values)
        styled += colour * _highlight(shine, values) + emission
    if values["rim_strength"] > 0:
        styled = styled + rim(facing(frame), direct[:, 3] / np.float32(values["key"]), values)
    difference = styled - lit
    left = left_by_media(frame)
    if left is not None:
        difference = difference * left[seen]
    result[seen, :3] = np.maximum(result[seen][:, :3] + difference, 0.0)
    return result


def left_by_media(frame: Frame) -> np.ndarray | None:
    """What media and mist leave of the surfaces' light (h, w, 3); None where no effect before has put any in front."""
    found = [frame.passes[name][..., :3] for name in ("transmittance", LEFT) if name in frame.passes]
    return np.prod(found, axis=0) if found else None


def shaded(total: np.ndarray, tone: np.ndarray, change: np.ndarray, values: dict) -> np.ndarray:
    """Irradiance (n, 3) that stands for ``total`` (n, 3) of tone ``tone`` and its ``change`` over a pixel (n,)."""
    key, width = np.float32(values["key"]), change * np.float32(values["softness"])
    level = tone
    if values["shading"] == 1 and values["per_channel"]:
        total = banded(total / key, values["bands"], width[:, None]) * key
        level = banded(tone, values["bands"], width)
    elif values["shading"] in (1, 2):
        brightness = luminance(total)
        hue = np.where((brightness > 1e-12)[:, None], total / np.maximum(brightness, _TINY)[:, None], np.float32(1.0))
        if values["shading"] == 1:
            level = banded(tone, values["bands"], width)
            total = hue * (level * key)[:, None]
        else:
            total = look_up(values["ramp"], tone) * (1 + (hue - 1) * np.float32(values["ramp_tint"])) * key
    if values["shadow_amount"] > 0:
        share = np.float32(values["shadow_amount"]) * (1 - np.clip(level, 0.0, 1.0))
        total = total + (np.float32(values["shadow_color"]) * key - total) * share[:, None]
    return total


def saturated(colour: np.ndarray, amount: float) -> np.ndarray:
    """``colour`` (..., 3) with its distance from grey of the same luminance times ``amount``; never negative."""
    if amount == 1.0:
        return colour
    grey = luminance(colour)[..., None]
    return np.maximum(grey + (colour - grey) * np.float32(amount), 0.0)


def facing(frame: Frame) -> np.ndarray:
    """Cosine (n,) between normals and the way to the eye of the n pixels in ``frame.gbuffer.seen``."""
    seen = frame.gbuffer.seen
    normals = frame.gbuffer.normal[seen][:, :3]
    if frame.view.orthographic:
        return -dot(normals, frame.view.forward.astype(np.float32))
    towards = frame.view.position.astype(np.float32) - frame.gbuffer.position[seen][:, :3]
    return dot(normals, towards) / np.maximum(np.sqrt(dot(towards, towards)), _TINY)


def rim(cosine: np.ndarray, lamps: np.ndarray, values: dict) -> np.ndarray:
    """Radiance (n, 3) of the rim light where ``cosine`` (n,) to the eye is small; by ``values["rim_light"]`` on the side of the
    lamps, which is where ``lamps`` (n,), their irradiance over the key light's, is: with their cosine and their shadows."""
    softness = np.maximum(np.float32(values["rim_softness"]), np.float32(1e-6))
    share = 1 - smooth_step((cosine - np.float32(values["rim_width"])) / softness + np.float32(0.5))
    share = share * (1 + (np.minimum(lamps, 1.0) - 1) * np.float32(values["rim_light"])) * np.float32(values["rim_strength"])
    return share[:, None] * np.float32(values["rim_color"])


def _highlight(shine: np.ndarray, values: dict) -> np.ndarray:
    """(n, 1 or 3): what ``shine`` (n,), the luminance that a layer reflects of lamps, becomes."""
    threshold = np.float32(values["highlight_threshold"])
    if values["highlights"] == 0:
        return shine[:, None]
    if values["highlights"] == 3:
        return np.zeros((len(shine), 1), np.float32)
    bright = np.float32(values["highlight_brightness"])
    if values["highlights"] == 2:
        return look_up(values["highlight_ramp"], shine / threshold) * bright * (shine > 0)[:, None]
    width = np.maximum(np.float32(values["highlight_softness"]) * threshold, np.float32(1e-6))
    return (smooth_step((shine - threshold) / width + np.float32(0.5)) * bright)[:, None]


def _parted(albedo: np.ndarray, direct: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lamps' colour (n, 3) and the luminance (n,) of the shine: ``direct`` (n, 4) = colour·(albedo/π·E + shine).

    E is known in luminance (``direct``'s fourth component) and the colour has luminance 1, which is one equation for the shine. It
    is exact for white layers under lamps of one colour; of several colours the shine has their mean.
    """
    below = albedo * (direct[:, 3:] * _INVERSE_PI)
    shine = np.zeros(len(direct), np.float32)
    bright = np.flatnonzero(luminance(direct[:, :3] / np.maximum(below, _TINY)) > 1.001)
    if bright.size:
        reflected, base = direct[bright, :3], below[bright]
        weights = np.float32([0.2126, 0.7152, 0.0722])
        found = np.maximum((reflected * weights - base).max(axis=1), 0.0)
        for _ in range(_STEPS):
            ratio = reflected / np.maximum(base + found[:, None], _TINY)
            slope = luminance(ratio / np.maximum(base + found[:, None], _TINY))
            found = found + (luminance(ratio) - 1) / np.maximum(slope, _TINY)
        shine[bright] = np.maximum(found, 0.0)
    return direct[:, :3] / np.maximum(below + shine[:, None], _TINY), shine
