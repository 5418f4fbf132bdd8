"""German. A bake is *Backen* and a probe a *Sonde*, as in Blender's own German; SH, RMSE and names of papers stay."""

from .interface import INTERFACE
from .sentences import SENTENCES

__all__ = ["INTERFACE", "SENTENCES"]
