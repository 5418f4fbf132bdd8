"""What a user may set on any bake that goes through voxels."""

from dataclasses import dataclass

from ..base import setting

# Where the voxels' light comes from.
SURFACES, VOXELS, MAPS = "surfaces", "voxels", "shadow maps"
# What nested grids lie about.
VOLUMES, CAMERA = "volumes", "camera"


@dataclass(frozen=True)
class VoxelSettings:
    """Settings of the voxels; the metadata builds panel and command line."""

    order: int = setting(2, "SH Order", "Highest band of the exported probes", "", 0, 2)
    resolution: int = setting(64, "Resolution", "Voxels along the longest side of the grid", "", 8, 1024)
    voxel_size: float | None = setting(None, "Voxel Size", "Side of a voxel; unset divides the longest side of the grid by the "
                                       "resolution", "m", 1e-6, 1e6)
    reach: float = setting(0.5, "Reach", "How far beyond the probe volumes the grid reaches for surfaces, as a share of the "
                           "volumes' longest side", "", 0.0, 100.0)
    cascades: int = setting(1, "Cascades", "Grids about one place, each half as large as the one around it, in voxels half as "
                            "large: finer there for as many voxels more", "", 1, 6)
    center: str = setting(VOLUMES, "About", "What cascades lie about: the middle of the probe volumes, or the scene's camera",
                          choices=(VOLUMES, CAMERA))
    light: str = setting(SURFACES, "Light on Voxels", "All light on surfaces, traced by rays, or the light of lamps, by shadow "
                         "rays or from their reflective shadow maps, and what voxels then send each other",
                         choices=(SURFACES, VOXELS, MAPS))
    map_resolution: int = setting(128, "Shadow Map Size", "Texels along a side of each lamp's reflective shadow maps", "px",
                                  16, 4096)
    bounces: int = setting(1, "Cached Bounces", "How often voxels send each other light before it is gathered, where they light "
                           "themselves", "", 0, 32)
    further_bounces: bool = setting(True, "Further Bounces", "Add what all further bounces would, in voxels twice as large")

    @property
    def hands_on(self) -> bool:
        """Whether voxels hand light on to each other."""
        return self.light != SURFACES

    @property
    def live(self) -> bool:
        """Whether the preview makes this light of what it draws, without a bake."""
        return True
