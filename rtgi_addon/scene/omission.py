"""What a file holds and the bake does not follow, one line each, with what is needed to find it and to say how much light it
concerns."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Omission:
    """One thing that is not followed, or only nearly.

    ``text`` is a sentence that names where it is. ``objects`` are the names of the objects and lamps that it concerns, and
    ``materials`` of the materials: every object that carries one of them is concerned. ``boxes_world`` (n, 2, 3) float64 holds the
    lowest and highest corners of what has no surface in the ``Scene`` (hair, a volume), one box a placement. ``remedy`` is given
    where the light cannot be known as long as it is so: what to do about it. A bake is refused until then.
    """

    text: str
    objects: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    boxes_world: np.ndarray | None = None
    remedy: str = ""

    def __str__(self) -> str:
        return self.text


class Omissions:
    """Collects omissions; what is said of many placements of one object becomes one line."""

    def __init__(self):
        self._found: dict[tuple[str, str], tuple[dict, dict, list]] = {}

    def add(self, text: str, *, objects: Iterable[str] = (), materials: Iterable[str] = (), box_world=None,
            remedy: str = "") -> None:
        """Take in one omission, or one more placement of what ``text`` says already; ``box_world`` (2, 3)."""
        names, surfaces, boxes = self._found.setdefault((text, remedy), ({}, {}, []))
        names.update(dict.fromkeys(objects))
        surfaces.update(dict.fromkeys(materials))
        if box_world is not None:
            boxes.append(np.asarray(box_world, np.float64))

    def all(self) -> tuple[Omission, ...]:
        """Everything collected, in the order in which it was met."""
        return tuple(Omission(text, tuple(names), tuple(surfaces), np.stack(boxes) if boxes else None, remedy)
                     for (text, remedy), (names, surfaces, boxes) in self._found.items())
