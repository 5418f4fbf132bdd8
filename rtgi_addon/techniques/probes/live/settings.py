"""What a user may set of probes that are kept up to date while the scene changes."""

from dataclasses import dataclass, field

from ...base import setting
from ..settings import ProbeSettings


@dataclass(frozen=True)
class LiveSettings:
    """Settings of live probes; ``probes`` are those of the bake that they stand for, of which order, tile, bounces, lamps and
    offset are kept to."""

    rays: int = setting(1 << 15, "Rays per Frame", "How many rays all probes together trace before the light is shown again", "",
                        1024, 1 << 22)
    hysteresis: float = setting(0.9, "Hysteresis", "Share of a probe's light that is kept when new rays arrive while the scene "
                                "changes: more is steadier and slower", "", 0.0, 0.995)
    rays_per_probe: int = setting(64, "Rays per Update", "Rays that a probe traces when its turn comes; where they are more than "
                                  "the rays of a frame, probes take turns", "", 8, 1024)
    noise: float = setting(0.01, "Rest Below", "Once the scene rests, probes gather light until its noise is below this share, and "
                           "then trace no more rays", "", 1e-4, 1.0)
    probes: ProbeSettings = field(default_factory=ProbeSettings)

    @property
    def live(self) -> bool:
        """The preview makes this light without a bake."""
        return True
