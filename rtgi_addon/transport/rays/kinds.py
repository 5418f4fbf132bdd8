"""Which surfaces rays meet by their kind: looks of probes and eyes, rays between surfaces, rays towards light."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..surfaces.geometry import Geometry
from ..surfaces.materials import Surfaces
from .alpha import AlphaTracer
from .choose import make_opaque_tracer
from .parts import JoinedTracer, PartTracer
from .tracer import Tracer


@dataclass(frozen=True, eq=False)
class Tracers:
    """One tracer a kind of ray; all the same one where all surfaces meet all kinds.

    ``camera``: what pictures show. ``view``: what a probe looks at from free space: all that cameras or diffuse rays meet.
    ``diffuse``: what surfaces see of one another. ``scatter``: what rays meet that media have scattered. ``shadow``: what stands
    between a surface and a light. ``light``: all that light from a lamp meets, in the way of others or not; it does not pass what
    is opaque to shadow rays, whatever it shows. ``opaque_shadow``: as ``shadow`` were no surface transparent.
    """

    camera: Tracer
    view: Tracer
    diffuse: Tracer
    scatter: Tracer
    shadow: Tracer
    light: Tracer
    opaque_shadow: Tracer


def make_tracers(geometry: Geometry, surfaces: Surfaces, threads: int | None = None,
                 make: Callable[[Geometry, tuple, int | None], Tracer] | None = None) -> Tracers:
    """Tracers of ``geometry`` that honour the ray visibility of its instances and the alpha of its materials. ``make`` makes the
    tracer of a part without its materials; it is given what kinds of rays meet that as well."""
    make = make or (lambda part, _pattern, threads: make_opaque_tracer(part, threads))
    visible = geometry.visibility
    kinds = {"camera": visible.camera, "view": visible.camera | visible.diffuse, "diffuse": visible.diffuse,
             "scatter": visible.scatter, "shadow": visible.shadow, "light": visible.camera | visible.diffuse | visible.shadow}
    seen = np.stack(list(kinds.values()), axis=1)
    parts = {}
    # A ray that passes a wall of a medium goes on a little beyond it, and would pass a surface in the same place as well.
    solid = ~surfaces.clear[geometry.material]
    # Instances are few, triangles many.
    for pattern in np.unique(seen[np.bincount(geometry.instance[solid], minlength=len(seen)) > 0], axis=0):
        index = np.flatnonzero((seen == pattern).all(axis=1)[geometry.instance] & solid)
        if index.size == geometry.count:
            parts[tuple(pattern.tolist())] = make(geometry, tuple(pattern.tolist()), threads)
        elif pattern.any():
            parts[tuple(pattern.tolist())] = PartTracer(make(geometry.part(index), tuple(pattern.tolist()), threads), index)
    def opaque(kind: int) -> tuple[tuple, Tracer]:
        chosen = tuple(pattern for pattern in parts if pattern[kind])
        return chosen, parts[chosen[0]] if len(chosen) == 1 else JoinedTracer([parts[pattern] for pattern in chosen])

    made: dict[tuple, Tracer] = {}
    result = {}
    for number, name in enumerate(kinds):
        chosen, tracer = opaque(number)
        passing = surfaces.transparent & ~surfaces.keeps_shadow if name == "light" else surfaces.transparent
        key = chosen, passing.tobytes()
        if key not in made:
            made[key] = AlphaTracer(tracer, geometry, surfaces, passing=passing) if surfaces.has_transparency else tracer
        result[name] = made[key]
    return Tracers(**result, opaque_shadow=opaque(list(kinds).index("shadow"))[1])
