"""A plan: what to bake a scene with, why, and what else there would have been."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ... import techniques
from ...errors import BakeError, UsageError
from ...numerics.grid import cell_size
from ...progress import Progress
from ...scene import NearSurfaces, ProbeVolume, Scene
from ...techniques.lattice.placement import PILOT_RAYS
from ...techniques.lattice.unseen import probes_near_surfaces
from ...techniques.probes.adaptive import FIRST_ROUND
from ...transport.context import LightContext
from ...transport.rays.ray_counter import count_rays
from ..metrics import Figure
from .alternatives import LOOSE, Measured, measure_others
from .fitted import fit_lattice
from .look import Look, Motion, look_at
from .nesting import FEWEST_PROBES, nest
from .pictures import PictureLook, look_at_picture
from .pilot import Pilot, Reading
from .price import Price, Prices
from .reasons import reasons
from .sample import Sample, draw_sample
from .search import Found, Search
from .tries import upper

# Surface points that a plan is made on, each under several normals.
POINTS = 2048
# Probes are only left out where that saves more than this share.
WORTH_LEAVING_OUT = 0.05
# The share that is usually left out of lattices that are just worth a look.
USUALLY_LEFT_OUT = 0.1
# A lattice of more probes than this is not proposed unless asked for: an irradiance volume of 5 MB at order 2 and half precision.
MOST_PROBES = 1 << 16
# Rays of a probe, its placement included, that no bake goes below.
LEAST_RAYS = FIRST_ROUND + 2.0 * PILOT_RAYS
# The highest order that probes have (techniques/probes/settings.py).
MOST_ORDER = 8
# Errors that may be asked for.
ERROR_RANGE = (0.001, 1.0)
# The setting that the rays of an option "rays to 1 %" have.
EXACT_RAYS = 0.01
# How far a plan is when the scene was looked at, the pilot is ready, and the lattice is found: later where nothing else is
# measured.
_LOOKED, _PILOTED, _FOUND, _FOUND_ALONE = 0.05, 0.3, 0.8, 0.95
# Of the way to what is found, where the lattices without others in them are.
_SINGLE = 0.7


@dataclass(frozen=True)
class Target:
    """What a plan has to meet: relative RMSE ``error`` of irradiance at receivers, with the probes of the bundle as this add-on
    reads them; ``memory`` bytes that the bake may take (None: any); ``probes`` that the lattices may have together. ``orders`` are
    the SH orders to choose from; ``keep_air`` keeps probes that no surface reads, for things that move through the air;
    ``nested`` has finer volumes looked for within coarser ones whatever that takes, which is done anyway where it takes little of
    the bake; ``fit`` has probes fitted to surfaces, on as coarse lattices as that allows, and no other technique chosen."""

    error: float = 0.05
    memory: float | None = None
    probes: int = MOST_PROBES
    orders: tuple[int, ...] = (1, 2)
    keep_air: bool = False
    nested: bool = False
    fit: bool = False

    def __post_init__(self):
        low, high = ERROR_RANGE
        if not low <= self.error <= high:
            raise UsageError(f"error is {self.error:g}", f"give a value from {low:g} to {high:g}")
        if not all(0 <= order <= MOST_ORDER for order in self.orders):
            raise UsageError(f"order is {max(self.orders)}", f"give a value from 0 to {MOST_ORDER}")
        if self.probes < 1 or (self.memory is not None and self.memory <= 0):
            raise UsageError("a plan needs some probes and some memory", "give numbers above 0")


@dataclass(frozen=True)
class Option:
    """One way to bake: ``label`` says how it differs; ``error`` at receivers is predicted (standard error over surface points);
    ``meets`` tells whether it meets the target with tries.CONFIDENCE; ``why_not`` why it is no option at all."""

    technique: str
    label: str
    resolutions: tuple[tuple[int, int, int], ...]
    error: Figure
    price: Price
    meets: bool
    why_not: str = ""


@dataclass(frozen=True, eq=False)
class Plan:
    """``technique`` with ``settings`` (overrides of its defaults) on ``volumes``, which replace the scene's of the same name; those
    with the name of another as ``planned`` are placed in that, in the place of all that earlier plans placed there.

    ``chosen`` is the first of ``options``, ``met`` whether it meets the ``target``; ``reasons`` say why, in sentences; ``kept`` of
    ``probes`` lattice points get rays. ``seconds`` and ``rays`` are what the plan itself took, ``rate`` the measured exponent of
    convergence. ``picture`` is what the camera's picture takes by true rays, None where that was not looked at.
    """

    target: Target
    technique: str
    settings: dict
    volumes: tuple[ProbeVolume, ...]
    met: bool
    options: tuple[Option, ...]
    reasons: tuple[str, ...]
    look: Look
    found: Found
    sample: Sample
    probes: int
    kept: int
    rate: float | None
    seconds: float
    rays: int
    seed: int
    picture: PictureLook | None = None

    @property
    def chosen(self) -> Option:
        """What is planned."""
        return self.options[0]

    def applied(self, scene: Scene) -> Scene:
        """``scene`` with the planned lattices, and notes that say so. Volumes that were not planned are left as they are."""
        planned = {volume.name: volume for volume in self.volumes}
        notes = tuple(f"planned: {line}" for line in self.reasons)
        stay = tuple(planned.get(volume.name, volume) for volume in scene.volumes if volume.planned not in planned)
        return replace(scene, volumes=(*stay, *(volume for volume in self.volumes if volume.planned)), notes=(*scene.notes, *notes))


def make_plan(scene: Scene, target: Target, *, seed: int = 0, threads: int | None = None, motion: Motion | None = None,
              others: bool = True, points: int = POINTS, progress: Progress | None = None) -> Plan:
    """The cheapest bake of ``scene`` that meets ``target``, or the best that can be had.

    ``others`` also measures the other techniques, which otherwise are only where the target is loose. Cheap is what takes few
    rays, so the same arguments give the same plan on any machine, but for its seconds. Raises BakeError, Cancelled.
    """
    progress = progress or Progress()
    started = perf_counter()
    if all(volume.planned for volume in scene.volumes):
        raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
    with count_rays() as counter:
        progress.step(0.0, "looking at the scene")
        # What earlier plans placed is placed anew.
        scene = replace(scene, volumes=tuple(replace(volume, settings={}, wanted=None, near=None) for volume in scene.volumes
                                             if not volume.planned))
        context = LightContext(scene, threads)
        scene_seconds = perf_counter() - started
        sample = draw_sample(context, scene.volumes, points, seed)
        look = look_at(context, scene.volumes, sample, motion or Motion(), seed)
        pilot = Pilot(context, scene.volumes, sample, tuple(sorted(target.orders)), target.error, seed,
                      progress.span(_LOOKED, _PILOTED))
        prices = Prices(pilot, scene_seconds)
        searched = progress.span(_PILOTED, _FOUND if others else _FOUND_ALONE)
        search = Search(pilot, prices, target.error, lambda volumes, order: _limit(prices, target, volumes, order),
                        searched.span(0.0, _SINGLE))
        found = search.run()
        large = found.reading.lattice_points >= FEWEST_PROBES
        found = nest(pilot, found, target.error, lambda volumes, order: _limit(prices, target, volumes, order),
                     lambda rays: target.nested or (large and search.may_spend(rays, found)), searched.span(_SINGLE, 1.0))
        keep_air = target.keep_air or bool(look.motion.objects)
        if target.fit:
            found = fit_lattice(pilot, found, target.error,
                                lambda reading: _volumes(context, reading, sample, scene.volumes, keep_air),
                                progress.span(_FOUND, _FOUND_ALONE))
        names = [name for name in techniques.names() if name != "probes"] if others or target.error > LOOSE else []
        measured = measure_others(pilot, names, seed, progress.span(_FOUND, _FOUND_ALONE))
        picture = look_at_picture(scene, threads, progress.span(_FOUND_ALONE, 1.0)) if others else None
        volumes = _volumes(context, found.reading, sample, scene.volumes, keep_air)
    kept = sum(int(np.prod(volume.resolution)) if volume.wanted is None else int(volume.wanted.sum()) for volume in volumes)
    options = _options(pilot, prices, found, measured, target, kept, others)
    chosen = options[0]
    settings = {"order": found.order, "error": found.ray_error} if chosen.technique == "probes" else {"order": found.order}
    if found.fitted and chosen.technique == "probes":
        settings["fit"] = True
    progress.step(1.0, "planned")
    return Plan(target, chosen.technique, settings, volumes, chosen.meets, options,
                tuple(reasons(look, found, chosen, scene.volumes, volumes, target, kept)), look, found, sample,
                found.reading.lattice_points, kept, found.rate, perf_counter() - started, counter.rays, seed,
                picture)


def _limit(prices: Prices, target: Target, volumes: tuple[ProbeVolume, ...], order: int) -> str:
    """The name of what ``volumes`` pass, or ""."""
    resolutions = [volume.resolution for volume in volumes]
    probes = sum(int(np.prod(resolution)) for resolution in resolutions)
    if probes > max(target.probes, min_probes(resolutions)):
        return "number of probes"
    if target.memory is not None and prices.bytes(volumes, order, probes * LEAST_RAYS) > target.memory:
        return "memory"
    return ""


def min_probes(resolutions) -> int:
    """Probes of lattices that have no more than two along any axis."""
    return sum(int(np.prod(np.minimum(resolution, 2))) for resolution in resolutions)


def _volumes(context: LightContext, reading: Reading, sample: Sample, files: tuple[ProbeVolume, ...],
             keep_air: bool) -> tuple[ProbeVolume, ...]:
    """The planned volumes, told which of their probes are worth rays."""
    # Looking at every triangle costs about as much as a ray or two each, and few probes are left out where there are few.
    if keep_air or reading.lattice_points * LEAST_RAYS * USUALLY_LEFT_OUT < len(context.geometry.triangles_world):
        return reading.volumes
    # The sample has points up to half a cell of the file's lattices outside of them.
    outside = 0.5 * max(float(cell_size(file.world_from_local, file.resolution).max()) for file in files)
    near = tuple(replace(volume, near=NearSurfaces(sample.lift, outside, sample.within < 1.0)) for volume in reading.volumes)
    planned = []
    for volume in near:
        wanted = probes_near_surfaces(context.geometry, volume, near)
        few = wanted.any() and wanted.mean() < 1.0 - WORTH_LEAVING_OUT
        planned.append(replace(volume, wanted=wanted) if few else replace(volume, near=None))
    return tuple(planned)


def _options(pilot: Pilot, prices: Prices, found: Found, measured: list[Measured], target: Target, kept: int,
             all_of_them: bool) -> tuple[Option, ...]:
    """What is planned first, then what else there is: other orders, rays and lattices of probes only if ``all_of_them`` are
    wanted."""
    def probes(reading, order, ray_error, label, share=None):
        error = found.error if label == "planned" else reading.error(order, ray_error)
        return Option("probes", label, reading.resolutions, error, prices.price(reading, order, ray_error, share),
                      upper(error) <= target.error)

    chosen = probes(found.reading, found.order, found.ray_error, "planned", kept)
    rest, planned = [], found.reading
    if found.fitted:
        rest.append(probes(found.measured, found.order, found.ray_error, "not fitted"))
        all_of_them = False
    for order in pilot.orders if all_of_them else ():
        if order != found.order:
            rest.append(probes(planned, order, found.ray_error, f"order {order}", kept))
    if all_of_them and found.ray_error > EXACT_RAYS:
        rest.append(probes(planned, found.order, EXACT_RAYS, f"rays to {100 * EXACT_RAYS:g} %", kept))
    if found.single is not None:
        rest.append(probes(found.single, found.order, found.ray_error, "nothing nested"))
    climb = [reading for reading in found.climb if reading not in (planned, found.single)] if all_of_them else []
    coarser = [reading for reading in climb if reading.lattice_points < planned.lattice_points]
    finer = [reading for reading in climb if reading.lattice_points > planned.lattice_points]
    rest += [probes(reading, found.order, found.ray_error, "coarser") for reading in coarser[-1:]]
    rest += [probes(reading, found.order, found.ray_error, "finer") for reading in finer[:1]]
    lattice = planned.error(found.order).value
    for other in measured:
        error = Figure(float(np.hypot(other.error.value, lattice)), other.error.standard_error)
        rays, seconds = other.rays + kept * other.rays_per_probe, other.seconds + kept * other.seconds_per_probe
        price = Price(rays, seconds, prices.bytes(planned.volumes, found.order, 0.0))
        option = Option(other.technique, "defaults", planned.resolutions, error, price,
                        not other.why_not and upper(error) <= target.error, other.why_not)
        # Nothing else can be fitted.
        if option.meets and price.rays < chosen.price.rays and not target.fit:
            rest.insert(0, chosen)
            chosen = replace(option, label="planned")
        else:
            rest.append(option)
    return chosen, *rest
