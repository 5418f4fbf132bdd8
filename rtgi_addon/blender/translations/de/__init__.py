"""German. A bake is *Backen* and a probe a *Sonde*, as in Blender's own German; SH, RMSE and names of papers stay."""

from .interface import INTERFACE as _INTERFACE
from .plans import PLANS
from .sentences import SENTENCES as _SENTENCES
from .settings import SETTINGS

__all__ = ["INTERFACE", "SENTENCES"]

INTERFACE: dict[str, str] = {**_INTERFACE, **SETTINGS}
SENTENCES: dict[str, str] = {**_SENTENCES, **PLANS}
