"""The media of a bundle made ready for an engine: where each is, what it does there, and the light that waits to be scattered.

An engine marches a ray: at every step it adds up the media there, what they give, and what they scatter of the ambient light, which
is the radiance of the baked field in SH on a lattice of its own. ``march`` is the twin of what the exports' shaders and scripts do
(`media.glsl`), on the very numbers that their textures hold.

Source of the step: S. Hillaire, "Physically Based and Unified Volumetric Rendering in Frostbite", SIGGRAPH 2015: what a slice gives
is integrated with what it takes of that.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import grid as lattice
from ...numerics import sh
from ...scene import Medium
from ...scene.medium import HENYEY_GREENSTEIN
from ...techniques.lattice.field import ProbeField
from ...transport.media.phase import phase_moments
from ..names import folder_names
from .axes import Axes
from .volumes import ORDER, to_half

# Samples of the ambient light along a side at most, and its steps to a cell of the finest probes.
AMBIENT_SIDE, AMBIENT_STEPS = 64, 2
# Below this optical depth a step's share is a series (media.glsl has the same number).
THIN = 0.01


@dataclass(frozen=True, eq=False)
class EngineMedium:
    """A medium within a box, in the engine's axes: ``unit_from_world`` (4, 4) maps its box to [0, 1]³. ``scattering``,
    ``absorption`` [1/unit] and ``emission`` (3,) multiply ``cells`` (blocks, nz, ny, nx, 3) float16, each block from 0 to 1: one
    block is density, which emission is not multiplied by; three are scattering, absorption and emission. ``moments`` are a₁ and a₂
    of its phase function."""

    name: str
    folder: str
    unit_from_world: np.ndarray
    scattering: np.ndarray
    absorption: np.ndarray
    emission: np.ndarray
    moments: np.ndarray
    cells: np.ndarray

    @property
    def resolution(self) -> tuple[int, int, int]:
        """Cells along x, y and z."""
        _, nz, ny, nx, _ = self.cells.shape
        return nx, ny, nz

    @property
    def world_from_unit(self) -> np.ndarray:
        """(4, 4): the box's place in the world."""
        return np.linalg.inv(self.unit_from_world)


@dataclass(frozen=True, eq=False)
class EngineMedia:
    """All media of an export along an engine's axes. Everywhere are ``extinction`` and ``emission`` (3,), and ``scattering``
    (3, 3): σ_s·a_l of band l. ``boxes`` are the others. ``ambient`` (nz, ny, nx, 9, 3) float16 is the radiance that arrives at the
    cells' centres of the box [0, 1]³ under the inverse of ``ambient_from_world``. ``notes`` are for the user."""

    extinction: np.ndarray
    emission: np.ndarray
    scattering: np.ndarray
    boxes: tuple[EngineMedium, ...]
    ambient: np.ndarray
    ambient_from_world: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def fills_space(self) -> bool:
        """Whether there is anything everywhere."""
        return bool(np.any(self.extinction > 0) or np.any(self.emission > 0))

    def source(self, points: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Extinction (n, 3) at ``points`` (n, 3), and what media there give and scatter of the ambient light (n, 3) along
        ``directions`` (n, 3) as a camera looks."""
        extinction = np.broadcast_to(self.extinction, (len(points), 3)).copy()
        given = np.broadcast_to(self.emission, (len(points), 3)).copy()
        scattering = np.broadcast_to(self.scattering, (len(points), 3, 3)).copy()
        for box in self.boxes:
            unit = lattice.transform_points(box.unit_from_world, points)
            rows = np.flatnonzero(np.all((unit >= 0) & (unit <= 1), axis=1))
            index, weight = lattice.trilinear(unit[rows] * box.resolution - 0.5, box.resolution)
            parts = [np.einsum("nkc,nk->nc", block.reshape(-1, 3).astype(np.float64)[index], weight) for block in box.cells]
            scattered, absorbed, emitted = parts if len(parts) == 3 else (parts[0], parts[0], 1.0)
            extinction[rows] += box.scattering * scattered + box.absorption * absorbed
            given[rows] += box.emission * emitted
            scattering[rows] += np.array([1.0, *box.moments])[:, None] * (box.scattering * scattered)[:, None]
        return extinction, given + np.maximum(np.sum(scattering * self.bands(points, directions), axis=1), 0.0)

    def bands(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """(n, 3, 3): what bands 0, 1 and 2 of the ambient light make along ``directions``."""
        nz, ny, nx = self.ambient.shape[:3]
        unit = lattice.transform_points(self.ambient_from_world, points)
        index, weight = lattice.trilinear(unit * (nx, ny, nz) - 0.5, (nx, ny, nz))
        light = np.einsum("nkbc,nk->nbc", self.ambient.reshape(-1, 9, 3).astype(np.float64)[index], weight)
        products = light * sh.evaluate(directions, ORDER)[..., None]
        return np.stack([products[:, 0], products[:, 1:4].sum(axis=1), products[:, 4:].sum(axis=1)], axis=1)

    def span(self, origins: np.ndarray, directions: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where along rays a march begins and how long it is: all of them where something is everywhere, else from the first box
        that a ray enters to the last one that it leaves."""
        if self.fills_space:
            return np.zeros(len(origins)), np.asarray(lengths, np.float64)
        first, last = np.asarray(lengths, np.float64).copy(), np.zeros(len(origins))
        for box in self.boxes:
            start, along = lattice.transform_points(box.unit_from_world, origins), directions @ box.unit_from_world[:3, :3].T
            along = np.where(np.abs(along) < 1e-12, 1e-12, along)
            low, high = -start / along, (1.0 - start) / along
            enter = np.maximum(np.minimum(low, high).max(axis=1), 0.0)
            leave = np.minimum(np.maximum(low, high).min(axis=1), lengths)
            met = leave > enter
            first, last = np.where(met, np.minimum(first, enter), first), np.where(met, np.maximum(last, leave), last)
        return first, np.maximum(last - first, 0.0)

    def march(self, origins: np.ndarray, directions: np.ndarray, lengths: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Transmittance and radiance (n, 3) along rays of ``lengths`` (n,) with unit ``directions``, in ``steps`` steps."""
        first, length = self.span(origins, directions, lengths)
        stride = (length / steps)[:, None, None]
        middles = first[:, None] + length[:, None] * ((np.arange(steps) + 0.5) / steps)
        points = (origins[:, None] + directions[:, None] * middles[..., None]).reshape(-1, 3)
        extinction, given = (values.reshape(len(origins), steps, 3)
                             for values in self.source(points, np.repeat(directions, steps, axis=0)))
        depth = extinction * stride
        passed = np.cumsum(depth, axis=1)
        gained = np.sum(np.exp(depth - passed) * given * slice_share(depth) * stride, axis=1)
        return np.exp(-passed[:, -1]), gained


def slice_share(depth: np.ndarray) -> np.ndarray:
    """(1 − e^−τ)/τ: what of a slice's light leaves it."""
    return np.where(depth < THIN, 1.0 - depth * (0.5 - depth / 6.0), -np.expm1(-depth) / np.maximum(depth, THIN))


def engine_media(media: tuple[Medium, ...], field: ProbeField, axes: Axes) -> EngineMedia | None:
    """The ``media`` of a bundle in the ambient light of ``field``, an ``engine_field``; None if there is none to be seen."""
    shown = tuple(medium for medium in media if medium.visible_camera)
    if not shown:
        return None
    notes = [f"medium {medium.name} is invisible to cameras and left out" for medium in media if not medium.visible_camera]
    extinction, emission, scattering, boxes = np.zeros(3), np.zeros(3), np.zeros((3, 3)), []
    folders = folder_names([medium.name for medium in shown])
    for medium, folder in zip(shown, folders, strict=True):
        moments = phase_moments(medium.phase, ORDER)
        if medium.phase.kind != HENYEY_GREENSTEIN and np.any(medium.scattering > 0):
            notes.append(f"medium {medium.name}: ambient light is scattered by the first moments of {medium.phase.kind}, that of "
                         f"an engine's own lamps as by Henyey-Greenstein of g = {moments[1]:.3f}")
        if medium.fills_space:
            extinction += medium.extinction / axes.scale
            emission += np.asarray(medium.emission) / axes.scale
            scattering += moments[:, None] * np.asarray(medium.scattering) / axes.scale
        else:
            boxes.append(_box(medium, folder, moments, axes))
    ambient, ambient_from_world, coarse = _ambient(field, axes)
    if coarse:
        notes.append(f"the ambient light in media is held on {AMBIENT_SIDE} cells a side at most, coarser than the probes")
    return EngineMedia(extinction, emission, scattering, tuple(boxes), ambient, ambient_from_world, tuple(notes))


def _box(medium: Medium, folder: str, moments: np.ndarray, axes: Axes) -> EngineMedium:
    grid = medium.grid
    density = np.asarray(grid.density, np.float32)[..., None]
    parts = {"scattering": density, "absorption": density, "emission": np.ones_like(density)}
    coloured = any(getattr(grid, kind) is not None for kind in parts)
    blocks, constants = [], {}
    for kind, values in parts.items():
        factor = getattr(grid, kind)
        held = np.repeat(values, 3, axis=3) if factor is None else values * factor
        # Halves hold what is about one best; without light or colour of its own one block serves all three.
        scale = float(held.max(initial=0.0)) or 1.0
        constants[kind] = np.asarray(getattr(medium, kind), np.float64) * (scale / axes.scale)
        blocks.append(held / np.float32(scale))
    cells = to_half(np.stack(blocks if coloured else blocks[:1]), f"medium {medium.name!r}")
    half = np.eye(4)
    half[:3, :3], half[:3, 3] = 2.0 * np.eye(3), -1.0
    unit_from_world = np.linalg.inv(axes.matrix(grid.world_from_local) @ half)
    return EngineMedium(medium.name, folder, unit_from_world, constants["scattering"], constants["absorption"],
                        constants["emission"], moments[1:], cells)


def _ambient(field: ProbeField, axes: Axes) -> tuple[np.ndarray, np.ndarray, bool]:
    """(nz, ny, nx, 9, 3) float16 of radiance on a lattice over all probes, (4, 4) that maps its box to [0, 1]³, and whether it is
    coarser than the probes. Sampled twice to a cell, by what probes see, so that walls part rooms as far as its cells can."""
    volumes = [lookup.volume for lookup in field.lookups]
    if len(volumes) == 1:
        box, cell = np.asarray(volumes[0].world_from_local, np.float64), None
        wanted = np.asarray(volumes[0].resolution) * AMBIENT_STEPS
    else:
        corners = np.concatenate([lattice.box_corners(volume.world_from_local) for volume in volumes])
        low, high = corners.min(axis=0), corners.max(axis=0)
        box = np.eye(4)
        box[:3, :3], box[:3, 3] = np.diag(0.5 * (high - low)), 0.5 * (low + high)
        cell = min(lattice.cell_size(volume.world_from_local, volume.resolution).min() for volume in volumes)
        wanted = np.ceil(AMBIENT_STEPS * (high - low) / cell - 1e-6).astype(int)
    resolution = tuple(int(count) for count in np.clip(wanted, 1, AMBIENT_SIDE))
    points = lattice.lattice_points(box, resolution)
    light = axes.harmonics(field.radiance_sh(points.reshape(-1, 3), ORDER)).reshape(*points.shape[:3], 9, 3)
    half = np.eye(4)
    half[:3, :3], half[:3, 3] = 2.0 * np.eye(3), -1.0
    coarse = bool(np.any(np.asarray(wanted) > AMBIENT_STEPS * AMBIENT_SIDE))
    return to_half(light, "the ambient light in media"), np.linalg.inv(axes.matrix(box) @ half), coarse
