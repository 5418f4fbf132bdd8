"""A bake of probes cut into blocks that know nothing of each other, for machines that know nothing of each other.

What all probes have in common is made once: where they stand, and a surface cache over what a sample of their rays meets and all
that leads to, solved. Every block begins with that cache. Surfaces that its own rays meet first are brought in for the block alone,
so a block's bytes depend on nothing but what was prepared: not on other blocks, their order, the machine's cores or a restart.
What that costs is that such surfaces are found again by every block that sees them.
"""

from collections.abc import Mapping

import numpy as np

from ...errors import BakeError
from ...numerics.sampling import hash_u32
from ...progress import Progress
from ...scene import ProbeVolume, Scene
from ...scene.capture import captured_light
from ...scene.memory import require_memory
from ...transport.cache.checkpoint import cache_state, labelled, part_of, restore_cache
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from ..base import BACKFACE_THRESHOLD, Checkpoint, Common, begin_bake, volumes_by_settings
from ..lattice.coverage import require_open
from ..lattice.near_notes import near_glow, notes_on
from ..lattice.placement import Placement, place
from .bake import BATCH_RAYS, Block, ProbeBake, surface_cache
from .block_field import BlockField, Bricks, Read
from .captured import capturing, lamp_light_of
from .gather import GROUP, Gatherer, gather
from .gathering import items_of
from .items import batches
from .memory import RayBytes, working_bytes
from .reach import Reach
from .relight import MAX_KEPT_RAYS
from .settings import ProbeSettings
from .surface_error import POINTS, Truth, error_against, light_on_surfaces

# Rays that find what the cache is to know, in all and at most from each probe.
SCOUTS, SCOUTS_OF_PROBE = 1 << 22, 512
# Probes, and the rays of each, that tell how bright all of them are: to a few per cent, of which an error is a share.
LOOKS, LOOK_RAYS = 512, 64
# Probes that are all read into memory for their error on surfaces; of more it is not estimated.
MOST_READ = 1 << 16
# Tells the numbers of one block apart from those of another.
_BLOCK = 0x626C6B
_PLACEMENT = ("positions", "offset", "validity", "measured", "reach")
# What preparing has done when probes stand, and when their rays have met what they meet.
_PLACED, _SCOUTED = 0.2, 0.9


class _Group:
    """The volumes of one bake that have settings and captured light in common."""

    def __init__(self, context: LightContext, settings: ProbeSettings, volumes: tuple[ProbeVolume, ...], seed: int,
                 placement: Placement):
        self.settings, self.volumes, self.seed, self.placement = settings, volumes, seed, placement
        self.context = capturing(context, captured_light(context.scene, volumes[0]))
        self.lamp_light = lamp_light_of(context, volumes[0], settings, seed)
        self.cache = surface_cache(self.context, volumes, settings, seed)

    def scout(self, progress: Progress) -> float:
        """Bring into the cache what rays from a sample of the probes meet, and solve it; how bright the probes are (ErrorModel)."""
        measured, settings = np.flatnonzero(self.placement.measured), self.settings
        if not measured.size:
            return 0.0
        gatherer = Gatherer(self.context, self.cache, self.placement, settings, self.seed)
        if settings.bounces != 0:
            rays = min(SCOUTS_OF_PROBE, max(64, SCOUTS // len(measured) // 64 * 64))
            probes = measured[::-(-len(measured) * rays // SCOUTS)]
            require_memory(working_bytes(self.cache, settings, Reach(0, 1.0), len(probes), BATCH_RAYS, MAX_KEPT_RAYS))
            items, done = items_of(probes, GROUP, rays), 0
            for batch in batches(items, BATCH_RAYS):
                require_memory({"rays": int(RayBytes.of(self.context).held * sum(item.ray_count for item in batch))})
                span = progress.span(done / len(items), (done + len(batch)) / len(items))
                traced = parallel_for(lambda i, batch=batch: gatherer.trace(batch[i]), len(batch), self.context.threads,
                                      span.span(0.0, 0.5), "what probes look at")
                walked = [hits.media.surface for hits in traced if hits.media is not None]
                self.cache.reach([hits.surface for hits in traced] + walked, span.span(0.5, 1.0))
                done += len(batch)
        looking = items_of(measured[::-(-len(measured) // LOOKS)], GROUP, LOOK_RAYS)
        sums = gather(gatherer, looking, progress.span(1.0, 1.0), "how bright it is")[2]
        norms = [np.sum((part.sh.reshape(-1, part.sh.shape[2] * 3) / LOOK_RAYS) ** 2, axis=1, dtype=np.float64) for part in sums]
        return float(np.sqrt(np.mean(np.concatenate(norms))))

    def known(self, state: Mapping[str, np.ndarray]) -> SurfaceCache:
        """A cache that stands where the one of ``state`` stood."""
        cache = self.cache.under(self.context, None)
        # Texels are marked in place; what their rays met, by far the most of it, is not.
        restore_cache(cache, {name: array if name.startswith("factors.") else np.array(array) for name, array in state.items()})
        return cache


class PreparedBlocks:
    """See BakeBlocks: those of a bake that ``ProbeBlocks.prepare`` has made ready."""

    def __init__(self, groups: list[_Group], states: list[dict[str, np.ndarray]]):
        self._groups, self._states = groups, states
        self._caches = [group.known(state) for group, state in zip(groups, states, strict=True)]
        self._known = [cache.count for cache in self._caches]
        self._bricks = [Bricks(group.volumes) for group in groups]
        self._ends = np.cumsum([len(bricks) for bricks in self._bricks])
        self.count = int(self._ends[-1])

    def bake(self, index: int, progress: Progress) -> dict[str, np.ndarray]:
        """See BakeBlocks: ``sh`` (n, k, 3), ``standard_error`` (n,), ``visibility`` (n, T², 2), ``validity`` (n,), ``offset``
        (n, 3), float32; the number of probe ``rays`` and of the cache's texels beyond those prepared (``found``)."""
        number = int(np.searchsorted(self._ends, index, side="right"))
        probes = self._bricks[number][index - int(self._ends[number]) + len(self._bricks[number])]
        group, state = self._groups[number], self._states[number]
        if self._caches[number].count > self._known[number]:
            self._caches[number] = group.known(state)
        cache, known = self._caches[number], self._known[number]
        placement = Placement(*(np.ascontiguousarray(getattr(group.placement, name)[probes]) for name in _PLACEMENT))
        bake = ProbeBake(group.context, group.volumes, group.settings, int(hash_u32(group.seed, index, _BLOCK)), progress,
                         Checkpoint(), "block", group.lamp_light, block=Block(placement, cache, float(state["brightness"][0])))
        bake.memory.forget()
        bake.run()
        sh, error = bake.measured()
        return {"sh": sh, "standard_error": error, "visibility": np.asarray(bake.visibility, np.float32),
                "validity": np.asarray(placement.validity, np.float32), "offset": np.asarray(placement.offset, np.float32),
                "rays": np.array([bake.ray_count], np.int64), "found": np.array([cache.count - known], np.int64)}


class ProbeBlocks:
    """See Blocks: those of a bake of probes."""

    def refusal(self, settings: ProbeSettings) -> str:
        """See Blocks."""
        return "--fit reads all probes at once" if settings.fit else ""

    def prepare(self, scene: Scene, settings: ProbeSettings, rng: np.random.Generator, progress: Progress,
                threads: int | None = None) -> Common:
        """See Blocks."""
        context, seed = begin_bake(scene, settings, rng, progress, threads)
        groups, arrays, usable, opened, held, count = volumes_by_settings(scene.volumes, settings), {}, [], {}, frozenset(), 0
        truths = []
        for number, (of_group, volumes) in enumerate(groups):
            if self.refusal(of_group):
                raise BakeError(f"volume {volumes[0].name} cannot be baked in parts, {self.refusal(of_group)}",
                                "switch Fit to Surfaces off there")
            span = progress.span(number / len(groups), (number + 1) / len(groups))
            span.stage("placement")
            placement = place(context, volumes, of_group.virtual_offset, span.span(0.0, _PLACED))
            require_open(volumes, placement.measured)
            span.stage("surfaces")
            group = _Group(context, of_group, volumes, seed, placement)
            brightness = np.array([group.scout(span.span(_PLACED, _SCOUTED))])
            if of_group.bounces != 0:
                truths.append(light_on_surfaces(group.context, group.cache, of_group, placement, group.lamp_light, scene.volumes,
                                                max(1, POINTS // len(groups)), span.span(_SCOUTED, 1.0)))
            arrays |= labelled(f"{number}.cache", {**cache_state(group.cache), "brightness": brightness})
            arrays |= labelled(f"{number}", {name: getattr(placement, name) for name in _PLACEMENT})
            good, moved = placement.validity >= 1.0 - BACKFACE_THRESHOLD, np.any(placement.offset != 0, axis=1)
            usable.append(placement.positions[good & ~moved])
            sizes = np.cumsum([int(np.prod(volume.resolution)) for volume in volumes])[:-1]
            opened |= {id(volume): float(part.mean()) for volume, part in zip(volumes, np.split(good | moved, sizes), strict=True)}
            held |= group.lamp_light.names
            count += len(Bricks(volumes))
        return Common(arrays, Truth.join(truths)._asdict(), np.concatenate(usable),
                      tuple(opened[id(volume)] for volume in scene.volumes), held, count,
                      notes_on(near_glow(context, scene.volumes)))

    def begin(self, scene: Scene, settings: ProbeSettings, rng: np.random.Generator, arrays: Mapping[str, np.ndarray],
              threads: int | None = None) -> PreparedBlocks:
        """See Blocks."""
        context, seed = begin_bake(scene, settings, rng, Progress(), threads)
        groups, states = [], []
        for number, (of_group, volumes) in enumerate(volumes_by_settings(scene.volumes, settings)):
            own = part_of(dict(arrays), f"{number}")
            groups.append(_Group(context, of_group, volumes, seed, Placement(*(own[name] for name in _PLACEMENT))))
            states.append(part_of(own, "cache"))
        return PreparedBlocks(groups, states)

    def field(self, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, read: Read, direct_lamps: frozenset[str] | None,
              truth: Mapping[str, np.ndarray]) -> BlockField:
        """See Blocks."""
        field = BlockField(volumes, settings, read, direct_lamps)
        if sum(int(np.prod(volume.resolution)) for volume in volumes) <= MOST_READ:
            error = error_against(Truth(**truth), field)
            field.stats["error_on_surfaces"] = None if error is None else error.to_json()
        return field


PROBE_BLOCKS = ProbeBlocks()
