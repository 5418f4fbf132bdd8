"""Which Python packages a bake needs and this Blender lacks: said in the panel, before the user presses Bake."""

from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec

from ..errors import BakeError


@dataclass(frozen=True)
class Package:
    """``module`` is the import name, ``purpose`` what it does here, ``required`` whether a bake fails without it."""

    module: str
    purpose: str
    required: bool


PACKAGES = (
    Package("numpy", "all computation", True),
    Package("OpenEXR", "writes the baked probes", True),
    Package("embreex", "traces rays; Blender's own, slower ray tracer stands in for it", False),
)


@cache
def missing() -> tuple[Package, ...]:
    """The packages this Python cannot find. Looked up once: installing one takes a restart of Blender anyway."""
    return tuple(package for package in PACKAGES if find_spec(package.module) is None)


def missing_required() -> list[Package]:
    """Those without which no bake can run."""
    return [package for package in missing() if package.required]


def remedy(packages) -> str:
    """What to do about ``packages``."""
    names = " ".join(package.module for package in packages)
    return f"install the extension's zip made for this system, or `pip install {names}` for Blender's Python, and restart Blender"


def require() -> None:
    """Raise BakeError naming the required packages that are missing."""
    needed = missing_required()
    if needed:
        listed = ", ".join(f"{package.module} ({package.purpose})" for package in needed)
        raise BakeError(f"Python packages are missing: {listed}", remedy(needed))
