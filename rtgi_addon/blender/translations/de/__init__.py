"""German. A bake is *Backen* and a probe a *Sonde*, as in Blender's own German; SH, RMSE and names of papers stay. Labels and
tooltips come in to `interface` and `settings`, what comes from below the panel to `sentences` and `plans`.
"""

from .atlas import ATLAS, ATLAS_LABELS
from .cycles import CYCLES
from .files import FILES
from .glow import GLOW
from .guidance import LABELS, MESSAGES
from .interface import INTERFACE as _INTERFACE
from .live import LIVE, LIVE_LABELS
from .media import MEDIA
from .plans import PLANS
from .reading import READING
from .roles import ROLES
from .scattered import SCATTERED, SCATTERED_LABELS
from .sentences import SENTENCES as _SENTENCES
from .settings import SETTINGS
from .spheres import SPHERE_LABELS, SPHERES
from .storage import STORAGE
from .styles import STYLE_SENTENCES, STYLES
from .transfer import TRANSFER, TRANSFER_LABELS
from .travel import TRAVEL
from .voxels import VOXEL_LABELS, VOXELS

__all__ = ["INTERFACE", "SENTENCES"]

INTERFACE: dict[str, str] = {**_INTERFACE, **SETTINGS, **ROLES, **LABELS, **STYLES, **TRANSFER_LABELS, **SPHERE_LABELS,
                             **LIVE_LABELS, **VOXEL_LABELS, **ATLAS_LABELS,
                             **SCATTERED_LABELS}
SENTENCES: dict[str, str] = {**_SENTENCES, **PLANS, **CYCLES, **READING, **MEDIA, **FILES, **STORAGE, **MESSAGES, **STYLE_SENTENCES,
                             **TRANSFER, **SPHERES, **LIVE, **TRAVEL, **VOXELS, **ATLAS, **SCATTERED, **GLOW}
