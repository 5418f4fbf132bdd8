"""A picture a person can judge a bake by: every probe as a sphere lit by what it holds, in the scene lit by the probes.

A sphere shows E(n)/π, the irradiance a probe gives to its normals: the brightness of a white paper ball with no lamp on it.
Surfaces show emission + albedo/π·(E of the field + E of the lamps with their shadows); leaks, ringing and dark probes can be
seen on both. Probes inside geometry are dark red with stripes.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..numerics import sh
from ..numerics.colour import srgb_from_linear
from ..numerics.grid import UNIT_BOX, cell_size, lattice_points
from ..numerics.sampling import sobol_owen
from ..progress import Progress
from ..scene import Scene
from ..scene.lights import lamps_to_add
from ..storage.png import write_png
from ..techniques import Field, ProbeGrid
from ..transport.context import LightContext
from ..transport.parallel import chunks, parallel_for
from ..transport.paths.direct import Receiver, lamp_irradiance
from ..transport.rays.tracer import offset_origins
from ..transport.vectors import dot, luminance
from .view import View, choose_view

RADIUS_IN_CELLS = 0.13
# Probes this near the camera would hide the scene behind them.
NEAREST_IN_RADII = 6.0
# Places within a pixel of the four samples that smooth edges: a rotated grid.
SUBPIXELS = ((0.375, 0.125), (0.875, 0.375), (0.625, 0.875), (0.125, 0.625))
# Samples of lamps for each of them, and the seed of their numbers.
LAMP_SAMPLES, SEED = 4, 0
# The stripes of invalid probes, so many across a sphere's radius and a bit more; and what is drawn where nothing is.
STRIPES = 4.0
INVALID_COLOURS = np.array([[0.16, 0.004, 0.004], [0.05, 0.001, 0.001]], np.float32)
BACKDROP = 0.012
# Exposure puts this share of what is drawn below the level where highlights begin to be rolled off.
EXPOSED_SHARE = 0.85
SHOULDER = 0.6


class Probes:
    """Every probe of ``grids`` as rows: ``centers`` (p, 3), ``radii`` (p,), ``coefficients`` (p, k, 3), ``invalid`` (p,) bool."""

    def __init__(self, grids: tuple[ProbeGrid, ...]):
        size = max(grid.sh.shape[3] for grid in grids)
        rows = []
        for grid in grids:
            points = lattice_points(grid.volume.world_from_local, grid.volume.resolution) + grid.offset_world
            padded = np.pad(grid.sh, [(0, 0)] * 3 + [(0, size - grid.sh.shape[3]), (0, 0)])
            radius = RADIUS_IN_CELLS * cell_size(grid.volume.world_from_local, grid.volume.nodes).min()
            counts = grid.counts
            rows.append((points[counts], np.full(counts.sum(), radius), padded[counts], ~grid.in_the_open[counts]))
        self.centers, self.radii, self.coefficients, self.invalid = (np.concatenate(column) for column in zip(*rows, strict=True))
        self.order = sh.order_of(size)

    def radiance(self, index: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """What spheres ``index`` (n,) show at ``normals`` (n, 3): E/π, never negative."""
        basis = sh.evaluate(normals, self.order) * (sh.cosine_coefficients(self.order) / np.float32(np.pi))
        colour = np.maximum(np.einsum("nk,nkc->nc", basis, self.coefficients[index]), 0.0)
        return colour.astype(np.float32)

    def stripes(self, normals: np.ndarray) -> np.ndarray:
        """The display colour (n, 3) of an invalid probe at ``normals`` (n, 3)."""
        return INVALID_COLOURS[(np.floor((normals[:, 0] + normals[:, 1] + normals[:, 2]) * STRIPES).astype(np.int64)) % 2]


def draw_probes(scene: Scene, field: Field, path, resolution: tuple[int, int] = (1280, 720), *, threads: int | None = None,
                progress: Progress | None = None) -> Path:
    """Draw ``field`` over ``scene`` into the PNG ``path`` and return it. The same input gives the same bytes.

    ``resolution`` (width, height) bounds the picture; the scene's camera keeps its own proportions within it. Raises BakeError
    if the file cannot be written, Cancelled through ``progress``.
    """
    progress = progress or Progress()
    context = LightContext(scene, threads)
    view = choose_view(scene, context, resolution)
    probes = Probes(field.grids())
    exposure, picture = None, 0.0
    for subframe in range(len(SUBPIXELS)):
        span = progress.span(subframe / len(SUBPIXELS), (subframe + 1) / len(SUBPIXELS))
        radiance, drawn, fixed = _draw(view, context, field, probes, subframe, span)
        if exposure is None:
            exposure = _exposure(radiance[drawn & ~fixed])
        shown = np.where(fixed[:, None], radiance, _rolled_off(radiance * exposure))
        picture = picture + np.where(drawn[:, None], shown, np.float32(BACKDROP))
    width, height = view.resolution
    encoded = srgb_from_linear(np.clip(picture / len(SUBPIXELS), 0.0, 1.0)).reshape(height, width, 3)
    return write_png(path, np.round(encoded * 255.0).astype(np.uint8))


def _draw(view: View, context: LightContext, field: Field, probes: Probes, subframe: int, progress: Progress):
    """One sample per pixel: radiance (n, 3), whether anything is there (n,), and whether it is a colour of the display (n,)."""
    width, height = view.resolution
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    across, down = SUBPIXELS[subframe]
    origins, directions = view.rays(column.ravel() + across, row.ravel() + down)
    hits = context.tracer.intersect(origins, directions)
    hit = (hits.primitive >= 0) & np.any(directions != 0, axis=1)
    depth = np.where(hit, hits.t, np.inf).astype(np.float32)
    sphere, depth = _spheres(view, probes, origins, directions, depth)

    radiance = np.zeros((len(origins), 3), np.float32)
    fixed = np.zeros(len(origins), bool)
    on_sphere = np.flatnonzero(sphere >= 0)
    normals = origins[on_sphere] + depth[on_sphere, None] * directions[on_sphere] - probes.centers[sphere[on_sphere]]
    normals = (normals / probes.radii[sphere[on_sphere], None]).astype(np.float32)
    for span in chunks(len(on_sphere)):
        radiance[on_sphere[span]] = probes.radiance(sphere[on_sphere[span]], normals[span])
    invalid = probes.invalid[sphere[on_sphere]]
    radiance[on_sphere[invalid]] = probes.stripes(normals[invalid])
    fixed[on_sphere[invalid]] = True

    on_surface = np.flatnonzero(hit & (sphere < 0))
    spans = chunks(len(on_surface))
    shifts = np.random.default_rng(SEED).random((len(origins), 3), np.float32)

    def shade(i):
        rows = on_surface[spans[i]]
        return _surface_radiance(context, field, directions[rows], hits.primitive[rows], hits.u[rows], hits.v[rows],
                                 subframe, shifts[rows])

    shaded = parallel_for(shade, len(spans), context.threads, progress, "Drawing the probes")
    for span, colours in zip(spans, shaded, strict=True):
        radiance[on_surface[span]] = colours
    if hits.tint is not None:
        radiance[on_surface] *= hits.tint[on_surface]
    outside = np.flatnonzero(~hit & (sphere < 0) & np.any(directions != 0, axis=1))
    if not context.environment.is_black:
        radiance[outside] = context.environment.radiance(directions[outside])
        hit[outside] = True
    return radiance, hit | (sphere >= 0), fixed


def _spheres(view: View, probes: Probes, origins, directions, depth) -> tuple[np.ndarray, np.ndarray]:
    """The nearest sphere of each ray (n,) int32, −1 where a surface is nearer, and the depth (n,) of what is seen.

    Each sphere meets only the rays of the pixels around it."""
    width, height = view.resolution
    corners = probes.centers[:, None] + probes.radii[:, None, None] * UNIT_BOX
    pixels, w = view.project(corners.reshape(-1, 3))
    pixels, w = pixels.reshape(-1, len(UNIT_BOX), 2), w.reshape(-1, len(UNIT_BOX))
    low = np.clip(np.floor(pixels.min(axis=1)) - 1, 0, (width, height)).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=1)) + 1, 0, (width, height)).astype(int)
    sphere = np.full(len(origins), -1, np.int32)
    depth = depth.copy()
    shape = height, width
    starts, ways = origins.reshape(*shape, 3), directions.reshape(*shape, 3)
    sphere_image, depth_image = sphere.reshape(shape), depth.reshape(shape)
    eye = view.camera.world_from_camera[:3, 3]
    away = np.linalg.norm(probes.centers - eye, axis=1) > NEAREST_IN_RADII * probes.radii
    for index in np.flatnonzero(away & (w.min(axis=1) > 0) & np.all(high > low, axis=1)):
        window = (slice(low[index, 1], high[index, 1]), slice(low[index, 0], high[index, 0]))
        towards = probes.centers[index].astype(np.float32) - starts[window]
        along = np.einsum("yxc,yxc->yx", towards, ways[window])
        aside = towards - along[..., None] * ways[window]
        room = np.float32(probes.radii[index] ** 2) - np.einsum("yxc,yxc->yx", aside, aside)
        t = along - np.sqrt(np.maximum(room, 0.0))
        nearer = (room > 0) & (t > 0) & (t < depth_image[window]) & (np.abs(ways[window]).max(axis=-1) > 0)
        depth_image[window][nearer] = t[nearer]
        sphere_image[window][nearer] = index
    return sphere, depth


def _surface_radiance(context: LightContext, field: Field, directions, primitive, u, v, subframe: int, shifts) -> np.ndarray:
    """Radiance (n, 3) leaving hits towards the camera, with both faces lit alike."""
    geometric = context.geometry.normals_world[primitive]
    geometric = np.where(dot(geometric, directions)[:, None] > 0, -geometric, geometric)
    shading = context.surfaces.shading_normal(primitive, u, v)
    shading = np.where(dot(shading, geometric)[:, None] < 0, -shading, shading)
    points = context.geometry.points(primitive, u, v)
    irradiance = np.asarray(field.irradiance(points, shading), np.float32)
    added = lamps_to_add(context.scene.lights, field.direct_lamps)
    if added:
        context = context if added is context.scene.lights else context.relit(replace(context.scene, lights=added))
        above = offset_origins(points, geometric, geometric)
        first = subframe * LAMP_SAMPLES
        last = first + (1 if context.lamps.count == 1 and context.lamps.is_delta[0] else LAMP_SAMPLES)
        # One low-discrepancy set over all samples of a pixel, shifted by the pixel's own random offset.
        for numbers in sobol_owen(last, 3, seed=SEED)[first:]:
            shifted = (numbers + shifts) % np.float32(1.0)
            light = lamp_irradiance(context, above, Receiver(shading, geometric, primitive), shifted)
            irradiance = irradiance + light / np.float32(last - first)
    cosine = -dot(context.geometry.normals_world[primitive], directions)
    emitted = context.surfaces.emission(primitive, u, v, cosine)
    return emitted + context.surfaces.albedo(primitive, u, v, cosine) * irradiance * np.float32(1.0 / np.pi)


def _exposure(radiance: np.ndarray) -> np.float32:
    """The factor that brings all but the brightest of ``radiance`` (n, 3) below the shoulder."""
    bright = float(np.quantile(luminance(radiance), EXPOSED_SHARE)) if len(radiance) else 0.0
    return np.float32(SHOULDER / bright if bright > 0 else 1.0)


def _rolled_off(value: np.ndarray) -> np.ndarray:
    """Linear up to the shoulder, then an exponential approach to 1: mid tones stay proportional to radiance."""
    over = np.maximum(value - SHOULDER, 0.0)
    return np.where(value <= SHOULDER, value, SHOULDER + (1.0 - SHOULDER) * (1.0 - np.exp(-over / (1.0 - SHOULDER))))
