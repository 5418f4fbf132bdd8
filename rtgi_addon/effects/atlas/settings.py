"""What a user may set of the light atlas."""

from dataclasses import dataclass

from ...techniques.base import setting


@dataclass(frozen=True)
class AtlasSettings:
    """How the light atlas is baked."""

    density: float = setting(8.0, "Density", "Texels along a metre of the surfaces in the light atlas", "1/m", 0.01, 1000.0)
    rays: int = setting(256, "Rays per Texel", "Rays from the surface that a texel of the light atlas covers", "", 16, 1 << 16)
    margin: int = setting(2, "Margin", "Texels about each object's islands that are filled from them", "px", 1, 64)
    suns: int = setting(8, "Sun Directions", "With radiance transfer: side of the square grid of directions from which the atlas "
                        "follows suns; below 3 none", "", 0, 32)
    largest: int = setting(2048, "Largest Side", "A light atlas with more texels along a side is refused", "px", 16, 16384)


class AtlasBake:
    """The settings under their name, for whatever makes options and panels of settings."""

    name, label, Settings = "atlas", "Light Atlas", AtlasSettings


ATLAS = AtlasBake()
