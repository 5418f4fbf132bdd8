"""What a user may set on a bake with virtual point lights."""

from dataclasses import dataclass

from ..base import setting


@dataclass(frozen=True)
class VplSettings:
    """Settings of instant radiosity; the metadata builds panel and command line."""

    lights: int = setting(4096, "Virtual Lights", "How many virtual lights stand for all bounced light; time grows in proportion",
                          "", 16, 1 << 20)
    order: int = setting(2, "SH Order", "Highest band of the spherical harmonics of the exported probes", "", 0, 8)
    bounces: int | None = setting(None, "Bounces", "How often light may be reflected; unset follows it until it has died away", "",
                                  0, 1000)
    direct: bool = setting(False, "Include Lamps", "Add the direct light of lamps, which engines usually add themselves")
    clamp: float | None = setting(None, "Clamp", "Bound of a virtual light's geometry term, against bright spots near surfaces; "
                                  "unset lets no light give more than the mean irradiance, or a tenth of it with compensation; "
                                  "0 has no bound", "1/m²", 0, 1e9)
    compensation: bool = setting(True, "Compensation", "Give back by short rays what the clamp takes away from corners")
    compensation_rays: int = setting(64, "Compensation Rays", "Short rays per receiver", "", 1, 4096)
    candidates: int = setting(16, "Candidates", "Virtual lights tried for each that is kept: of more, those that light the volumes "
                              "are found more surely", "", 1, 256)
