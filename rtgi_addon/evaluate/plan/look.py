"""What a scene has and lacks, as far as it decides how to bake it: found with a few rays, told in plain sentences."""

from dataclasses import dataclass

import numpy as np

from ...numerics.sampling import fibonacci_sphere
from ...scene import ProbeVolume
from ...techniques.lattice.focus import spacing_of
from ...transport.context import LightContext
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot
from .media import MediaLook, look_at_media
from .media import sentences as sentences_on_media
from .sample import Sample

# Rays from each of as many open probes, that tell how much sky is seen.
RAYS, MOST_EYES = 64, 256
# The thinnest walls: thickness below which lies this share of what is seen.
THIN_QUANTILE = 0.05
# Shares that are not worth a sentence: of sky that is seen through cracks, and of surface outside the volumes.
_UNSEEN = 0.005
# Names of what moves that a sentence lists.
_SHOWN_NAMES = 3


@dataclass(frozen=True)
class Motion:
    """Names of what moves: ``lamps`` by animation, drivers or constraints, and other ``objects`` (armatures and physics too)."""

    lamps: tuple[str, ...] = ()
    objects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Look:
    """``sky`` share of rays from open probes that leave the scene; ``world_light`` whether the world shines; ``lamps`` how many
    there are; ``emitters`` emissive triangles; ``wall`` thickness [m] of the thinnest walls (0: sheets; None: nothing lies behind
    any), ``thin`` share of the seen surface whose wall is thinner than ``spacing``, the smallest cell side [m] of the file's
    lattices; ``within`` share of the seen surface in the volumes; ``media`` what they do to light (None: there are none)."""

    sky: float
    world_light: bool
    lamps: int
    emitters: int
    wall: float | None
    thin: float
    spacing: float
    within: float
    motion: Motion
    media: MediaLook | None = None

    @property
    def enclosed(self) -> bool:
        """True if no light comes in from the world."""
        return self.sky == 0.0 or not self.world_light


def look_at(context: LightContext, volumes: tuple[ProbeVolume, ...], sample: Sample, motion: Motion, seed: int = 0) -> Look:
    """Look at the scene of ``context`` from the open probes of ``volumes`` and at the receivers of ``sample``; ``seed`` draws the
    paths that media are looked at by."""
    eyes = sample.eyes[np.linspace(0, len(sample.eyes) - 1, min(MOST_EYES, len(sample.eyes))).astype(int)].astype(np.float32)
    directions = fibonacci_sphere(RAYS)
    hits = context.tracer.intersect(np.repeat(eyes, RAYS, axis=0), np.tile(directions, (len(eyes), 1)))
    spacing = spacing_of(volumes)
    thickness = wall_thickness(context, sample)
    known = thickness[np.isfinite(thickness)]
    return Look(float(np.mean(hits.primitive < 0)), not context.environment.is_black, context.lamps.count, context.emitters.count,
                float(np.quantile(known, THIN_QUANTILE)) if len(known) else None, float(np.mean(thickness < spacing)), spacing,
                sample.within, motion, look_at_media(context, volumes, sample, seed))


def wall_thickness(context: LightContext, sample: Sample) -> np.ndarray:
    """How much solid (p,) [m] lies behind each point of ``sample``: 0 behind a sheet with space on its other side, infinite where
    nothing comes after the surface."""
    upright = sample.receivers.take(sample.receivers.own)
    inward = -upright.normals
    # Receivers lie just above their own surface: the first hit is that.
    first = context.tracer.intersect(upright.points, inward)
    surface = upright.points + inward * np.where(first.primitive >= 0, first.t, 0.0)[:, None]
    hits = context.tracer.intersect(offset_origins(surface, upright.normals, inward, first.t), inward)
    met = np.flatnonzero(hits.primitive >= 0)
    thickness = np.full(len(inward), np.inf)
    leaves = dot(context.geometry.normals_world[hits.primitive[met]], inward[met]) > 0
    thickness[met] = np.where(leaves, hits.t[met], 0.0)
    return thickness


def sentences(look: Look) -> list[str]:
    """What was found, for a person."""
    lines = []
    if look.enclosed and look.sky < _UNSEEN:
        lines.append("The scene is enclosed: no sky is seen, and no ray is spent on it.")
    elif not look.world_light:
        lines.append(f"The scene is open ({_share(look.sky)} of the directions), but the world is black: no ray is spent on it.")
    else:
        lines.append(f"The sky is seen in {_share(look.sky)} of the directions and lights the scene.")
    lines.append(_sources(look))
    if look.wall is not None and look.thin > 0:
        thinnest = "sheets without thickness" if look.wall == 0 else f"down to {look.wall:.2g} m thick"
        lines.append(f"Behind {_share(look.thin)} of what is seen the wall is thinner than the {look.spacing:.2g} m between the "
                     f"file's probes ({thinnest}); the distances that every probe keeps hold light back there.")
    if look.within < 1.0 - _UNSEEN:
        lines.append(f"{_share(1 - look.within).capitalize()} of the surface that probes see lies outside the volumes, where the "
                     "outermost probes are all there is.")
    if look.media is not None:
        lines += sentences_on_media(look.media)
    if look.motion.lamps:
        lines.append(f"{_moving(look.motion.lamps)}: the bake holds the light of this frame. Probes are relit from what their rays "
                     "hit, without new ones, and so follow a lamp in the preview.")
    if look.motion.objects:
        lines.append(f"{_moving(look.motion.objects)}: probes in mid-air are kept to light what moves; the light that it reflects "
                     "stays where it is in this frame.")
    return lines


def _sources(look: Look) -> str:
    kinds = [f"{count:,} {name}{'s' * (count > 1)}" for count, name in
             ((look.lamps, "lamp"), (look.emitters, "emissive triangle")) if count]
    if not kinds:
        return "There is neither a lamp nor an emissive surface, and none is sampled."
    verb = "lights" if look.lamps + look.emitters == 1 else "light"
    missing = ""
    if len(kinds) == 1:
        missing = "; no surface emits, and none is sampled" if look.lamps else "; there are no lamps to sample"
    return f"{' and '.join(kinds)} {verb} it{missing}."


def _share(value: float) -> str:
    return "less than 1 %" if 0 < value < 0.01 else f"{100 * value:.0f} %"


def _moving(names: tuple[str, ...]) -> str:
    shown = ", ".join(repr(name) for name in names[:_SHOWN_NAMES])
    if len(names) > _SHOWN_NAMES:
        shown += f" and {len(names) - _SHOWN_NAMES} more"
    return f"{shown} {'moves' if len(names) == 1 else 'move'}"
