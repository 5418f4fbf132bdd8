"""What a user may set of scattered placement."""

from dataclasses import dataclass

from ..base import setting

LATTICE, SCATTERED = "lattice", "scattered"
PLACEMENTS = (LATTICE, SCATTERED)


@dataclass(frozen=True)
class ScatterSettings:
    """Where probes of a bake stand."""

    placement: str = setting(LATTICE, "Placement", "Where probes stand: on the lattice of each volume, or scattered above its "
                             "floors, no denser than that lattice, where light needs them", choices=PLACEMENTS)
    error: float = setting(0.05, "Thinning", "Scattered probes are left out whose light their neighbours predict within this "
                           "relative error", "", 0.001, 1.0)
    points: str = setting("", "Probe Points", "Collection whose Empties are probes in any case, beside those that are placed")
    add: bool = setting(True, "Add Where Needed", "Place probes where light needs them beside those of Probe Points; without, "
                        "those are all there are")
    rays: int = setting(256, "Rays to Look", "Rays of each place that is looked at before probes are scattered", "", 64, 1 << 14)

    @property
    def scatters(self) -> bool:
        """Whether probes are scattered."""
        return self.placement == SCATTERED

    @property
    def adds(self) -> bool:
        """Whether probes are placed beside those that are asked for."""
        return self.add or not self.points


class Scatter:
    """The settings under their name, for whatever makes options and panels of settings."""

    name, label, Settings = "scatter", "Placement", ScatterSettings


SCATTER = Scatter()
