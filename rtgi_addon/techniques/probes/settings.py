"""What a user may set on a probe bake."""

from dataclasses import dataclass

from ..base import setting

# What a fixed number of rays N usually reaches: USUAL_ERROR/√N, and no target beyond these: a finer cache costs more than the rays,
# a coarser one shows.
USUAL_ERROR, LEAST_ERROR, MOST_ERROR = 0.3, 0.003, 0.05


@dataclass(frozen=True)
class ProbeSettings:
    """Settings of the SH probe bake; the metadata builds panel and command line."""

    order: int = setting(2, "SH Order", "Highest band of the spherical harmonics: 2 is what engines read, 1 is smaller", "", 0, 8)
    error: float = setting(0.01, "Target Error", "Relative RMSE of the coefficients at which a probe stops tracing rays", "",
                           1e-4, 1.0)
    rays: int | None = setting(None, "Rays per Probe", "A fixed number of rays for every probe instead of a target error", "",
                               16, 1 << 20)
    bounces: int | None = setting(None, "Bounces", "How often light may be reflected; unset follows it until it has died away", "",
                                  0, 1000)
    direct: bool = setting(False, "Include Lamps", "Add the direct light of lamps, which engines usually add themselves")
    max_rays: int = setting(1 << 15, "Most Rays", "No probe traces more rays than this, however noisy its surroundings", "",
                            256, 1 << 20)
    visibility_resolution: int = setting(8, "Visibility Tile", "Side of each probe's octahedral tile of distances", "px", 4, 32)
    fit: bool = setting(False, "Fit to Surfaces", "Change what probes store so that surfaces, and what moves, read from them what "
                        "is nearest to the light there: better light from the same probes, for up to twice the time")
    virtual_offset: bool = setting(True, "Virtual Offset", "Move probes that lie just inside geometry out of it")
    texel_size: float | None = setting(None, "Texel Size", "Side of the surface cache's texels; unset chooses it from scene, "
                                       "spacing and target error", "m", 1e-6, 1e6)
    cache_rays: int | None = setting(None, "Cache Rays", "Rays from each texel of the surface cache; unset chooses them by the "
                                     "target error", "", 8, 4096)

    @property
    def target(self) -> float:
        """The error that the surface cache aims at: the target itself, or what a fixed number of rays usually reaches."""
        return self.error if self.rays is None else min(max(USUAL_ERROR * self.rays**-0.5, LEAST_ERROR), MOST_ERROR)
