"""Live probes of a scene: a frame traces a budget of rays; `follow` takes in what has changed between two.

What it is not: exact where the bake is. Light is reflected from the lattice (`hits`), media that scatter are passed through as if
they only absorbed, and a lamp's limit of bounces is not kept to; `notes` say what of that concerns the scene.
"""

from dataclasses import asdict, dataclass, replace

import numpy as np

from ....errors import BakeError
from ....numerics.sampling import hash_u32
from ....progress import Progress
from ....scene import Instance, Scene
from ....scene.capture import captured_light, direct_light
from ....transport.context import LightContext, changed_surfaces, same_values
from ....transport.lights.lamps import UNLIMITED
from ....transport.parallel import parallel_for
from ....transport.rays.moving import MovingTracers
from ...base import validate_settings, volumes_by_settings
from ...lamp_light import LampLight
from ...lattice.coverage import NoUsableProbe, fitted_in_place, require_open
from ...lattice.field import ProbeField
from ...lattice.lookup import LookupSettings
from .hits import LiveGatherer
from .lattice import LiveLattice
from .settings import LiveSettings

# Samples of each lamp that has an extent, where its direct light is wanted: one set for all frames.
LAMP_SAMPLES = 16
# How the lattice is read for its own bounces: without what bends it where it rings, for that darkens noise.
_FEEDBACK = LookupSettings(reconstruction="linear")
# Building a tree costs about as much a triangle as so many rays: what has moved is followed when frames have cost as much.
RAYS_PER_TRIANGLE = 6
_FRAME = 0x11FE


@dataclass(frozen=True)
class LiveFrame:
    """What a frame did: ``rays`` of so many ``probes``, of which there are ``awake`` in all."""

    rays: int
    probes: int
    awake: int


class LiveProbes:
    """Probes on the volumes of ``scene`` that are kept up to date as ``settings`` say. The same calls with the same ``seed`` give
    the same light for any number of ``threads``. Not for several threads at once.

    ``notes`` are lines for the user. Raises BakeError for a scene that cannot be baked, UsageError for settings out of range,
    Cancelled.
    """

    def __init__(self, scene: Scene, settings: LiveSettings | None = None, seed: int = 0, threads: int | None = None,
                 progress: Progress | None = None):
        self.settings, self._threads = settings or LiveSettings(), threads
        validate_settings(self.settings)
        validate_settings(self.settings.probes)
        # As a bake draws its own from the same number.
        self._seed = int(np.random.default_rng(seed).integers(1 << 32))
        self.frames = self.rays = 0
        self._begin(scene, progress or Progress())

    def _begin(self, scene: Scene, progress: Progress) -> None:
        if not scene.volumes:
            raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
        self.scene, self._pending = scene, None
        self._tracers = MovingTracers()
        self._context = LightContext(scene, self._threads, make=self._tracers)
        self._owed = 0
        self._field = None
        try:
            lattices = self._placed(scene, progress)
        except NoUsableProbe as refused:
            fitted = fitted_in_place(scene, refused)
            if fitted is None:
                raise
            lattices = self._placed(fitted[0], progress)
        self._lattices = lattices

    def _placed(self, scene: Scene, progress: Progress) -> list[LiveLattice]:
        lattices = []
        for probes, volumes in volumes_by_settings(scene.volumes, self.settings.probes):
            lattices.append(LiveLattice.begin(volumes, self.settings, probes, *self._lit(volumes[0], probes), progress))
            require_open(volumes, lattices[-1].placement.measured)
        return lattices

    def _lit(self, volume, probes) -> tuple[LightContext, LampLight]:
        """The light that ``volume`` captures, and what of lamps it holds."""
        captured = self._capturing(captured_light(self._context.scene, volume))
        return captured, LampLight(self._capturing(direct_light(self._context.scene, volume)), probes.direct, LAMP_SAMPLES,
                                   self._seed)

    def _capturing(self, scene: Scene) -> LightContext:
        if scene is self._context.scene:
            return self._context
        same = scene.materials is self._context.scene.materials and scene.media is self._context.scene.media
        return LightContext(scene, self._threads, same_surfaces=self._context if same else None)

    @property
    def settled(self) -> bool:
        """True if another frame would change nothing: all has been followed, and no probe is awake."""
        return self._pending is None and not any(lattice.awake.any() for lattice in self._lattices)

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the scene live probes do not follow."""
        found = []
        if self._context.media.scatters:
            found.append("Live probes do not follow what media scatter: bake for that")
        if np.any(self._context.lamps.max_bounces < UNLIMITED):
            found.append("Live probes reflect the light of all lamps without a limit of bounces: bake for that")
        if any(lattice.probes.bounces for lattice in self._lattices):
            found.append("Live probes reflect light never or without a limit of bounces: bake for another number")
        return tuple(found)

    def follow(self, scene: Scene, progress: Progress | None = None) -> bool:
        """Go on in ``scene``: its lamps and world at once, what has moved as soon as frames have cost as much as following it did
        the last time. False if nothing of it concerns light. Raises BakeError, Cancelled: then it begins anew with the next."""
        progress = progress or Progress()
        before = self.scene
        if before is None or not same_values(scene.volumes, before.volumes):
            self._restart(scene, progress)
            return True
        if changed_surfaces(before, scene):
            self._pending = scene
            if self.rays >= self._owed:
                self._take_surfaces(progress)
                return True
            # The lamps go on meanwhile, among what stood there before.
            scene = replace(before, lights=scene.lights, world=scene.world)
        else:
            # What had moved has moved back.
            self._pending = None
        if same_values(scene.lights, before.lights) and same_values(scene.world, before.world):
            return self._pending is not None
        self.scene = scene
        self._context = self._context.relit(scene)
        for lattice in self._lattices:
            lattice.relit(*self._lit(lattice.volumes[0], lattice.probes))
        return True

    def _restart(self, scene: Scene, progress: Progress) -> None:
        self.scene = None
        self._begin(scene, progress)

    def _take_surfaces(self, progress: Progress) -> None:
        before, scene, self._pending = self.scene, self._pending, None
        built = self._tracers.built
        self.scene = None
        self._context = LightContext(scene, self._threads, make=self._tracers)
        changed = changed_instances(before, scene)
        for lattice in self._lattices:
            lattice.moved(*self._lit(lattice.volumes[0], lattice.probes), *changed, progress)
        self.scene = scene
        self._owed = self.rays + RAYS_PER_TRIANGLE * (self._tracers.built - built)

    def wake(self) -> None:
        """Go on as if something had changed: probes blend by the hysteresis until that would have been followed."""
        for lattice in self._lattices:
            lattice.wake()

    def frame(self, progress: Progress | None = None) -> LiveFrame:
        """Trace the rays of a frame, shared among the volumes by how many of their probes are awake; take in what waits. Raises
        Cancelled, after which the probes hold what they did before."""
        progress = progress or Progress()
        if self._pending is not None and self.rays >= self._owed:
            self._take_surfaces(progress)
        awake = [int(lattice.awake.sum()) for lattice in self._lattices]
        rays = probes = 0
        made = []
        for lattice, count in zip(self._lattices, awake, strict=True):
            if count:
                made.append((lattice, *self._trace(lattice, int(self.settings.rays * count / sum(awake)), progress)))
        # Only now: all of them were shaded by the frame before.
        for lattice, chosen, brought in made:
            lattice.blend(chosen, *brought)
            lattice.passed(chosen)
            probes += len(chosen)
            rays += len(chosen) * self.settings.rays_per_probe
        if made:
            self._field = None
        elif self._pending is not None:
            # Nobody traces that could pay for it.
            self._take_surfaces(progress)
        self.frames += 1
        self.rays += rays
        return LiveFrame(rays, probes, sum(awake))

    def _trace(self, lattice: LiveLattice, rays: int, progress: Progress):
        """The probes whose turn it is, and what their rays bring."""
        chosen, probes = lattice.turns(rays), lattice.probes
        seed = self._seed if lattice.rounds == 0 else int(hash_u32(self._seed, lattice.rounds, _FRAME))
        gatherer = LiveGatherer(lattice.context, lattice.placement, probes, self._seed).of_frame(seed, self._feedback(lattice))
        items = lattice.items(chosen)
        parts = parallel_for(lambda i: gatherer.gathered(items[i]), len(items), self._threads, progress, "live probes")
        row = np.zeros(len(lattice.light), np.int64)
        row[chosen] = np.arange(len(chosen))
        light = np.zeros((len(chosen), *lattice.light.shape[1:]), np.float32)
        distance = np.zeros((len(chosen), *lattice.distance.shape[1:]), np.float32)
        weight = np.zeros((len(chosen), *lattice.distance_weight.shape[1:]), np.float32)
        for part in parts:
            rows = row[part.probes]
            light[rows] = part.sh / np.float32(self.settings.rays_per_probe)
            distance[rows], weight[rows] = part.distance, part.distance_weight
        return chosen, (light, distance, weight)

    def _feedback(self, lattice: LiveLattice) -> ProbeField | None:
        """The light that surfaces reflect which rays of ``lattice`` meet: what it holds itself, and no lamp's directly."""
        if lattice.probes.bounces == 0 or not lattice.age.any():
            return None
        return ProbeField(lattice.grids(lamps=False), lookup=_FEEDBACK)

    @property
    def field(self) -> ProbeField:
        """The light as it is now."""
        if self._field is None:
            grids = tuple(grid for lattice in self._lattices for grid in lattice.grids())
            held = frozenset().union(*(lattice.lamp_light.names for lattice in self._lattices))
            self._field = ProbeField(grids, direct_lamps=held,
                                     params=asdict(self.settings.probes), stats={"rays": self.rays, "frames": self.frames})
        return self._field


def changed_instances(before: Scene, after: Scene) -> tuple[np.ndarray, np.ndarray | None]:
    """Boxes (b, 2, 3) [m] around every instance that is not where or what it was, there and here, and the numbers of those; where
    instances came or went or materials changed, one box around everything, and None."""
    pairs = list(zip(before.instances, after.instances, strict=False))
    if len(before.instances) != len(after.instances) or not same_values(before.materials, after.materials, looks=False):
        boxes = [_box(scene, instance) for scene in (before, after) for instance in scene.instances]
        boxes = np.array([box for box in boxes if box is not None])
        return (np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])[None] if len(boxes) else np.zeros((0, 2, 3))), None
    moved = [index for index, (old, new) in enumerate(pairs)
             if not (same_values(old, new) and same_values(before.meshes[old.mesh], after.meshes[new.mesh]))]
    boxes = [box for index in moved for box in (_box(before, pairs[index][0]), _box(after, pairs[index][1])) if box is not None]
    return np.array(boxes).reshape(-1, 2, 3), np.array(moved, np.int64)


def _box(scene: Scene, instance: Instance) -> np.ndarray | None:
    vertices = scene.meshes[instance.mesh].vertices_local
    if not len(vertices):
        return None
    matrix = np.asarray(instance.world_from_local, np.float64)
    ends = np.array([vertices.min(axis=0), vertices.max(axis=0)], np.float64)
    corners = np.stack(np.meshgrid(*ends.T, indexing="ij"), axis=-1).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.array([corners.min(axis=0), corners.max(axis=0)])
