"""What a user may set on a bake from reflective shadow maps."""

from dataclasses import dataclass

from ..base import setting


@dataclass(frozen=True)
class RsmSettings:
    """Settings of the RSM bake; the metadata builds panel and command line."""

    order: int = setting(2, "SH Order", "Highest band of the spherical harmonics of the probes", "", 0, 8)
    resolution: int = setting(512, "Map Resolution", "Every lamp has this number squared of texels, over all of its maps", "px",
                              16, 2048)
    samples: int = setting(400, "Samples", "Texels that each receiver reads of every lamp", "", 8, 1 << 16)
    every_texel: bool = setting(False, "Every Texel", "Sum over all texels instead of sampling them: slow, the reference")
    visibility: bool = setting(False, "Test Visibility", "Trace a shadow ray to every sampled texel; the paper's gather has none "
                               "and leaks through walls")
    disk_radius: float = setting(0.3, "Disk Radius", "Radius of the importance disk around the projected receiver, in sides of "
                                 "the map", "", 0.01, 1.5)
    disk_share: float = setting(0.4, "Disk Share", "Share of the samples in the disk; the others follow the flux. 1 is the "
                                "paper's pattern, which misses what lies outside the disk", "", 0.0, 1.0)
    area_points: int = setting(4, "Points per Area Lamp", "From how many points an area lamp is captured", "", 1, 64)
    focus: float = setting(3.0, "Sun Focus", "A sun's map covers this many times the box around all volumes", "", 1.0, 1000.0)

    @property
    def live(self) -> bool:
        """Whether the preview makes this light of what it draws, without a bake: not where shadow rays are to be traced."""
        return not self.visibility
