"""Passes of a picture on the CPU: the twin of shaders/film.comp.glsl."""

import numpy as np

from .base import EFFECT_PASSES
from .frame import GATHERED, Frame

# Means of these mean nothing: they are those of the first sample, which is taken at the pixels' centres.
NOT_AVERAGED = frozenset({"depth", "object"})


def pass_of(frame: Frame, name: str) -> np.ndarray:
    """One sample of the pass called ``name`` (h, w, 4) float32."""
    if name == "combined":
        return frame.light
    if name in EFFECT_PASSES:
        return frame.passes.get(name, np.float32([*[EFFECT_PASSES[name]] * 3, 1.0]) + np.zeros_like(frame.light))
    gbuffer, result = frame.gbuffer, np.zeros_like(frame.light)
    result[gbuffer.seen, 3] = 1.0
    if name == "depth":
        result[..., :3], result[..., 3] = frame.depth[..., None], 1.0
    elif name == "object":
        result[..., :3] = gbuffer.instance[..., None] + 1
    else:
        irradiance = frame.kept.get(GATHERED, frame.irradiance)
        values = {"direct": frame.direct, "irradiance": irradiance, "albedo": gbuffer.albedo, "normal": gbuffer.normal,
                  "indirect": gbuffer.albedo * irradiance * np.float32(1.0 / np.pi)}[name]
        result[gbuffer.seen, :3] = values[gbuffer.seen][:, :3]
    return result
