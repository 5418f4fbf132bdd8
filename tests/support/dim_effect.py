"""An effect that is wrong by a known amount, and a furnace of which every pixel is known."""

from dataclasses import dataclass, replace

import numpy as np
import scene_builders as build
from offset_technique import constant_grid
from picture_stage import view

from rtgi_addon.effects import Effect, setting
from rtgi_addon.scene import Camera
from rtgi_addon.techniques.lattice.field import ProbeField

SIZE = 32, 20
# Radiance everywhere in the furnace: emission 1 and half of 2.
LEVEL = 2.0


@dataclass(frozen=True)
class DimSettings:
    """How wrong."""

    share: float = setting(0.9, "Share", "What is left of the light", "", 0.0, 9.0)
    noise: float = setting(0.0, "Noise", "Standard deviation of a pixel in a sample", "", 0.0, 9.0)


class Dim(Effect):
    """The picture times ``share``, and noise of each sample; remembers the fields that it was given."""

    name, label, description, stage = "dim", "Dimmed", "Wrong by a known amount, for tests", "style"
    Settings = DimSettings

    def __init__(self, stage="style"):
        self.stage, self.fields = stage, []

    def sweep(self, pixels):
        """From very wrong to nearly right."""
        return DimSettings(share=0.5), DimSettings(), DimSettings(share=1.0, noise=0.4)

    def apply(self, frame, field, settings):
        """See Effect.apply."""
        self.fields.append(field)
        noise = settings.noise * np.random.default_rng(frame.index).standard_normal(frame.light.shape)
        return frame.light * settings.share + noise


def furnace():
    """Radiance 2 everywhere, and a camera within."""
    looks = view((0.1, 0.1, 0.1))
    return replace(build.cube_furnace(albedo=0.5, emission=1.0, resolution=(2, 2, 2)), cameras=(
        Camera("Eye", looks.world_from_camera, looks.clip_from_camera, (320, 200)),))


def field_of(scene):
    """Probes that know the furnace exactly."""
    return ProbeField([constant_grid(volume, LEVEL) for volume in scene.volumes], stats={"rays": 0})


def truth(noise, seed=3):
    """Two noisy pictures of the furnace."""
    return LEVEL + noise * np.random.default_rng(seed).standard_normal((2, SIZE[1], SIZE[0], 3))
