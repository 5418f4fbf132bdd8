"""What a user may set on a bake of transfer."""

from dataclasses import dataclass

from ..base import setting

# The surface cache is as fine as that of probes whose error is LEVEL/√rays, within these.
LEVEL, LEAST_ERROR, MOST_ERROR = 0.6, 0.005, 0.05


@dataclass(frozen=True)
class TransferSettings:
    """Settings of transfer; the metadata builds panel and command line."""

    order: int = setting(2, "SH Order", "Highest band of the spherical harmonics of the probes", "", 0, 4)
    rays: int = setting(2048, "Rays per Probe", "Rays of every probe", "", 64, 1 << 16)
    bounces: int | None = setting(None, "Bounces", "How often light may be reflected; unset follows it until it has died away", "",
                                  0, 1000)
    sky_order: int = setting(2, "Sky Order", "Highest band of the skies that are transferred exactly; what of a sky is beyond goes "
                             "by the sun's directions", "", 0, 4)
    sun_side: int = setting(24, "Sun Directions", "Side of the square grid of directions from which the sun is transferred: 24 "
                            "are 576 directions", "", 3, 64)
    sun_below: bool = setting(False, "Sun from Below", "Transfer suns from below the horizon as well, for twice the storage")
    sun_vectors: int = setting(0, "Sun Vectors", "Store suns as products with so many vectors that all probes share: 64 take a "
                               "fifth of 576 directions; 0 stores all", "", 0, 1024)
    sites: int = setting(32, "Lamp Sites", "Probes at which a lamp is transferred to all the others, for lamps that the bake does "
                         "not know", "", 0, 256)
    half: bool = setting(True, "Half Floats", "Store what sky, suns and lamp sites give in 16 bits")
    visibility_resolution: int = setting(8, "Visibility Tile", "Side of each probe's octahedral tile of distances", "px", 4, 32)
    virtual_offset: bool = setting(True, "Virtual Offset", "Move probes that lie just inside geometry out of it")
    texel_size: float | None = setting(None, "Texel Size", "Side of the surface cache's texels; unset chooses it from scene, "
                                       "spacing and rays", "m", 1e-6, 1e6)
    cache_rays: int | None = setting(None, "Cache Rays", "Rays from each texel of the surface cache; unset chooses them by the "
                                     "rays of probes", "", 8, 4096)

    @property
    def target(self) -> float:
        """The error that the surface cache aims at."""
        return min(max(LEVEL * self.rays**-0.5, LEAST_ERROR), MOST_ERROR)
