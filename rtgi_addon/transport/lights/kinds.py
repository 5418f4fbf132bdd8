"""Every kind of lamp, in the order of their numbers: a new one comes in as a module and an entry here."""

from ...scene import Light
from .area import Area
from .kind import LampKind
from .point import Point
from .spot import Spot
from .sun import Sun

KINDS: tuple[LampKind, ...] = (Sun(), Point(), Spot(), Area())
_NUMBERS = {kind.light: number for number, kind in enumerate(KINDS)}
# For shaders: LAMP_SUN and so on.
DEFINES = tuple((f"LAMP_{kind.name}", str(number)) for number, kind in enumerate(KINDS))


def kind_number(light: Light) -> int:
    """The index in ``KINDS`` of a lamp's kind."""
    return _NUMBERS[type(light)]


def kind_of(light: Light) -> LampKind:
    """All that is known of a lamp's kind."""
    return KINDS[kind_number(light)]
