"""What texels of a light atlas make of any light: precomputed radiance transfer on a surface (Sloan, Kautz and Snyder, SIGGRAPH
2002).

Of every texel NUMBERS numbers a colour are kept of each light: its coefficients, and its irradiance.
"""

from dataclasses import dataclass

import numpy as np

from ...techniques.transfer.lighting import Lighting
from .coefficients import COUNT

# What is kept of a texel, a colour: its coefficients, and its irradiance.
NUMBERS = COUNT + 1
# A grid of directions of fewer a side has none.
LEAST_SIDE = 3


@dataclass(frozen=True, eq=False)
class AtlasTransfer:
    """Matrices of all texels, float32, red, green and blue first where they are coloured: ``sky`` (height, width, NUMBERS, S) takes
    the coefficients of a sky to what is seen of it, ``bounce`` (3, …, S) to what surfaces reflect of it; ``suns`` (3, …, K) a sun
    of irradiance 1 from each of the K directions to what surfaces reflect of it, ``seen`` (…, K) to itself, for what of a sky goes
    by suns; ``lights`` (3, …, G) are the light of each of the bake's own lights, in the order of the bundle's transfer. There are
    ``sun_side``² directions (0: none), twice as many with those ``sun_below`` the horizon."""

    sky_order: int
    sun_side: int
    sun_below: bool
    sky: np.ndarray
    bounce: np.ndarray
    suns: np.ndarray
    seen: np.ndarray
    lights: np.ndarray

    @property
    def follows_suns(self) -> bool:
        """Whether it knows suns."""
        return self.sun_side > 0

    def follows(self, lighting: Lighting) -> bool:
        """Whether texels know all of ``lighting``: suns if they know any, no lamps that are new."""
        return (self.follows_suns or not lighting.suns) and not lighting.lamps
