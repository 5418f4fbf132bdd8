"""How far a batch of a bake is when each of its parts is done, by what they cost: the bar is to move as time does."""

from typing import NamedTuple

# What a texel of the surface cache costs for each of its rays, in rays of probes: 1.5 to 4 with its solution, measured on one core
# in the samples. Of that the solution takes a quarter, and of a ray of probes tracing two fifths, shading as much.
TEXEL_COST, _SOLVING, _TRACING = 2.0, 0.25, 0.4


class Shares(NamedTuple):
    """How far a batch is when its rays are traced, the cache has grown, and is solved; how many ``texels`` it will then have."""

    traced: float
    grown: float
    solved: float
    texels: int

    @staticmethod
    def of(rays: float, new: float, texels: int) -> "Shares":
        """Of a batch that costs as much as ``rays`` of probes and ``new`` more for its texels."""
        traced = _TRACING * rays / max(rays + new, 1.0)
        rest = 1.0 - 2.0 * traced
        return Shares(traced, traced + (1.0 - _SOLVING) * rest, traced + rest, texels)


# Of a batch that meets hardly any new texel.
USUAL = Shares.of(1.0, 0.0, 0)
