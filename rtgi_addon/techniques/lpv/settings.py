"""What a user may set on a bake of light propagation volumes."""

from dataclasses import dataclass

from ..base import setting


@dataclass(frozen=True)
class LpvSettings:
    """Settings of light propagation volumes; the metadata builds panel and command line."""

    order: int = setting(1, "SH Order", "Highest band of the exported probes; the volumes themselves hold order 1", "", 0, 2)
    resolution: int = setting(16, "Resolution", "Cells along each side of every cascade; finer ones show smaller things and "
                              "take more steps", "", 4, 4096)
    cascades: int = setting(1, "Cascades", "Nested volumes of the same resolution, each with cells twice as large", "", 1, 8)
    cell_size: float | None = setting(None, "Cell Size", "Side of the finest cascade's cells; unset fits that cascade around the "
                                      "probe volumes and the room they stand in", "m", 1e-6, 1e6)
    center: str = setting("volumes", "Center", "What the cascades are centred on: 'volumes', 'camera' or the name of an object",
                          or_object=("volumes", "camera"))
    steps: int = setting(256, "Steps", "How often light moves on by one cell; games use 8, a room needs ten times its cells",
                         "", 1, 4096)
    further_bounces: bool = setting(True, "Further Bounces", "Reflect light that meets geometry while it is propagated")
    blocking: bool = setting(True, "Blocking", "Let geometry stop light between cells")
    occluders: str = setting("surfaces", "Occluders", "Geometry that blocks: all surfaces in the volume, or only what lamps and "
                             "cameras see of it", choices=("surfaces", "views"))
    map_resolution: int = setting(128, "Shadow Map Size", "Texels along a side of each lamp's reflective shadow maps", "px",
                                  16, 4096)
    dampening: bool = setting(False, "Self-light Damping", "Use the intensity's derivative along the normal to keep surfaces from "
                              "lighting themselves")

    @property
    def live(self) -> bool:
        """Whether the preview makes this light of what it draws, without a bake."""
        return True
