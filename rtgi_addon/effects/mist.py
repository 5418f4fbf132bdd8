"""Mist: what is further away fades into the world behind it, or into a colour (depth cueing, aerial perspective without a medium).

The share of mist is that of Blender's own mist pass, by the world's mist settings (Cycles, kernel/film/data_passes.h):
saturate((d − start) / depth) to the power of 2, 1 or ½ for quadratic, linear and inverse quadratic falloff, with d the distance
from the eye, for a parallel projection the depth. Things vanish into what the world shows behind them, and below the horizon into
what it shows at the horizon: skies have nothing below it. What it is not: a medium. It scatters no light and throws no shadows, and
its density is a look, not an extinction; styles fade with what it leaves of a surface all the same.
"""

from dataclasses import dataclass

import numpy as np

from ..scene import Scene
from ..transport.lights.environment import Environment
from .base import Effect, setting
from .frame import Frame

# What mist leaves of the light of surfaces, 0 where there are none: for effects after it (Frame.passes), and no pass of users.
LEFT = "left_by_mist"
_EXPONENTS = {"linear": 1.0, "quadratic": 2.0, "inverse_quadratic": 0.5}


@dataclass(frozen=True)
class MistSettings:
    """What a user may set; what is unset is as the world's own mist settings say."""

    fade_to: str = setting("world", "Fade To", "What things vanish into: the world behind them, or a colour",
                           choices=("world", "color"))
    color: tuple[float, float, float] = setting((0.5, 0.6, 0.7), "Mist Color", "What things vanish into, if not the world", "",
                                                0.0)
    strength: float = setting(1.0, "Mist Strength", "How much of the light mist can take", "", 0.0, 1.0)
    start: float | None = setting(None, "Mist Start", "Distance from the eye at which mist begins; unset as the world's mist pass",
                                  "m", 0.0, 1e6)
    depth: float | None = setting(None, "Mist Depth", "Distance over which mist thickens; unset as the world's mist pass", "m",
                                  0.001, 1e6)
    falloff: str = setting("world", "Mist Falloff", "How mist thickens with distance; world as the world's mist pass",
                           choices=("world", *_EXPONENTS))
    over_world: bool = setting(True, "Over the World", "Cover the world, too: nothing is further away")


class MistEffect(Effect):
    """See the module's docstring."""

    name, label, description = "mist", "Mist", "What is further away fades into the world or a colour"
    stage = "media"
    local = True
    Settings = MistSettings

    def parameters(self, settings: MistSettings, scene: Scene) -> dict:
        """See Effect.parameters."""
        own = scene.mist
        depth = own.depth if settings.depth is None else settings.depth
        falloff = own.falloff if settings.falloff == "world" else settings.falloff
        return {"fades_to_world": settings.fade_to == "world", "color": settings.color, "strength": settings.strength,
                "start": own.start if settings.start is None else settings.start, "over_world": settings.over_world,
                # As Cycles has it: no depth is no mist.
                "inverse_depth": 1.0 / depth if depth > 0 else 0.0, "exponent": _EXPONENTS[falloff],
                # The centre of the first row of the world's map above the horizon.
                "lowest_slope": min(np.tan(0.5 * np.pi / len(scene.world.equirect)), 1.0)}

    def apply(self, frame: Frame, field, settings: MistSettings) -> np.ndarray:
        """See Effect.apply."""
        values = self.parameters(settings, frame.scene)
        gone = _above_horizon(frame, values) if values["fades_to_world"] else np.float32([*values["color"], 1.0])
        share = np.float32(values["strength"]) * np.where(frame.gbuffer.seen, mist(frame.distance, values), np.float32(1.0))
        faded = frame.light + (gone - frame.light) * share[..., None]
        frame.passes[LEFT] = np.repeat(np.where(frame.gbuffer.seen, 1 - share, np.float32(0.0))[..., None], 4, axis=-1)
        covered = frame.gbuffer.seen | (values["over_world"] and not frame.transparent)
        return np.where(covered[..., None], faded, frame.light)


def _above_horizon(frame: Frame, values: dict) -> np.ndarray:
    """(h, w, 4) what the world shows, below the horizon what it shows at the horizon; nothing for a transparent film."""
    if frame.transparent:
        return np.zeros_like(frame.light)
    directions = frame.directions.reshape(-1, 3).copy()
    flat = np.hypot(directions[:, 0], directions[:, 1])
    directions[:, 2] = np.maximum(directions[:, 2], np.float32(values["lowest_slope"]) * flat)
    radiance = Environment(frame.scene.world).radiance(directions).reshape(*frame.light.shape[:2], 3)
    return np.concatenate([radiance, np.ones_like(radiance[..., :1])], axis=-1)


def mist(distance: np.ndarray, values: dict) -> np.ndarray:
    """Share of mist, of the shape of ``distance`` [m] from the eye, in [0, 1]; ``values`` are MistEffect's parameters."""
    share = np.clip((distance - np.float32(values["start"])) * np.float32(values["inverse_depth"]), 0.0, 1.0)
    return share ** np.float32(values["exponent"])


EFFECT = MistEffect()
