"""Energy and shape: bright walls, small emitters, light from one direction, bright spots in corners, light that spreads.

Sources: R. Ramamoorthi and P. Hanrahan, SIGGRAPH 2001, and P.-P. Sloan, SIGGRAPH Asia 2017 (ringing); A. Keller, SIGGRAPH 1997, and
T. Kollig and A. Keller, MCQMC 2004 (bright spots and the clamp's loss); A. Kaplanyan and C. Dachsbacher, I3D 2010 (self-lighting,
diffusion of light volumes); the integrating sphere: any text on radiometry.
"""

import numpy as np

from ...numerics import sh
from ...numerics.grid import lattice_points
from ...numerics.sampling import fibonacci_sphere
from ...transport.context import LightContext
from ...transport.paths.reference import irradiance_at
from ..metrics import relative_rmse
from .case import LOOKUP, Bench, Case, Sample, Variant
from .parts import (
    ONE,
    REFERENCE_SEED,
    box,
    brightness,
    grey,
    point,
    quad,
    receivers,
    room_with_block,
    scene,
    sphere,
    spot,
    volume,
)


def _near_one_albedo(bench: Bench) -> list[Sample]:
    samples, wall = [], sphere("wall", 1.0)
    corners = wall.vertices_local[wall.triangles[::7]].astype(np.float64)
    points = corners.mean(axis=1).astype(np.float32)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    for albedo in (0.5, 0.9, 0.98):
        built = scene("sphere", [wall], [grey(albedo)], [point((0.2, 0.1, 0.0), 1.0)],
                      volumes=[volume(-0.7 * ONE, 0.7 * ONE, (4, 4, 4))])
        field = bench.bake(built, **_coarse(bench))
        # Flux 4 pi over the sphere's 4 pi gives 1 directly, and by each bounce albedo times the one before.
        exact = albedo if bench.technique == "rsm" else albedo / (1.0 - albedo)
        error = abs(brightness(field, points, normals).mean() / exact - 1.0)
        samples.append(Sample(f"albedo {albedo:g}", float(error), built, field))
    return samples


def _emitter_size(bench: Bench) -> list[Sample]:
    samples = []
    points, normals = receivers(-ONE, ONE, 4)
    below = points[:, 2] < 0.6
    points, normals = points[below], normals[below]
    for half in (0.4, 0.1, 0.02, 0.004):
        panel = quad("panel", (-half + 0.2, -half, 0.999), (0, 2 * half, 0), (2 * half, 0, 0), material=1)
        built = scene("panel", [box("room", -ONE, ONE, inward=True), panel], [grey(0.5), grey(0.0, 1.0 / half**2, "glow")],
                      volumes=[volume(-ONE, ONE, (4, 4, 4))])
        exact = irradiance_at(LightContext(built, bench.threads), points, normals, 1024, seed=REFERENCE_SEED)
        field = bench.bake(built, **_coarse(bench))
        error = relative_rmse(np.asarray(field.irradiance(points, normals)), exact.mean, exact.standard_error**2)
        samples.append(Sample(f"{2000 * half:g} mm wide", error, built, field))
    return samples


def patch_scene():
    """A black room in which a spot lights one small white patch: probes see light from one direction."""
    patch = quad("patch", (-0.1, 1.99, -0.1), (0, 0, 0.2), (0.2, 0, 0), material=1)
    return scene("one direction", [box("room", -2 * ONE, 2 * ONE, inward=True), patch],
                 [grey(0.0, name="black"), grey(0.8, name="patch")], [spot((0.0, 0.5, 1.0), (0.0, 1.99, 0.0), 10.0, 4.0)],
                 volumes=[volume(-0.4 * ONE, 0.4 * ONE, (2, 2, 2))])


def _one_direction(bench: Bench) -> list[Sample]:
    """The error over all normals at a probe, of what is the cosine lobe of one direction."""
    built, normals, samples = patch_scene(), fibonacci_sphere(512), []
    for order in (1, 2, 4):
        field = bench.bake(built, order=order)
        origin, peak, towards = _patch_light(field)
        found = brightness(field, np.tile(origin, (len(normals), 1)).astype(np.float32), normals) / peak
        error = np.sqrt(np.mean((found - np.maximum(normals @ towards, 0.0)) ** 2))
        samples.append(Sample(f"order {order}", float(error), built, field))
    return samples


def _negative_light(bench: Bench) -> list[Sample]:
    """How far below zero the probes' irradiance goes where an engine reads the coefficients as they are."""
    built, normals, samples = patch_scene(), fibonacci_sphere(512), []
    for order in (1, 2):
        field = bench.bake(built, order=order)
        _, peak, _ = _patch_light(field)
        coefficients = np.asarray(field.grids()[0].sh, np.float64)[0, 0, 0, :, 1]
        found = (sh.evaluate(normals, order) * sh.cosine_coefficients(order)) @ coefficients
        samples.append(Sample(f"order {order}", float(max(-found.min(), 0.0) / peak), built, field))
    return samples


def _patch_light(field) -> tuple[np.ndarray, float, np.ndarray]:
    """The first probe's place, the irradiance of a normal towards the patch if that were one direction, and that direction."""
    grid = field.grids()[0]
    origin = lattice_points(grid.volume.world_from_local, grid.volume.resolution)[0, 0, 0]
    towards = np.array([0.0, 1.99, 0.0]) - origin
    return origin, float(grid.sh[0, 0, 0, 0, 1]) * 2.0 * np.sqrt(np.pi), towards / np.linalg.norm(towards)


def _fireflies(bench: Bench) -> list[Sample]:
    """How much too bright the brightest of many points near the edges of a room is."""
    built, along, samples = room_with_block(), np.linspace(-0.85, 0.85, 40), []
    field, context = bench.bake(built, **_coarse(bench)), LightContext(built, bench.threads)
    bounces = 1 if bench.technique == "rsm" else None
    for height in (0.3, 0.1, 0.01, 0.001):
        points = np.concatenate([np.stack([along, np.full(40, -1.0), np.full(40, -1 + height)], axis=1),
                                 np.stack([np.full(40, -1 + height), np.full(40, 1.0), along], axis=1)]).astype(np.float32)
        normals = np.repeat(np.float32([[0, 1, 0], [0, -1, 0]]), 40, axis=0)
        exact = irradiance_at(context, points, normals, 512, bounces=bounces, seed=REFERENCE_SEED).mean.mean(axis=1)
        samples.append(Sample(f"{1000 * height:g} mm from the edge",
                              float(max((brightness(field, points, normals) / exact).max() - 1.0, 0.0)), built, field))
    return samples


def _lone_plate(bench: Bench) -> list[Sample]:
    """What a lit plate with nothing around it receives of its own light."""
    samples = []
    for degrees in (0.0, 30.0):
        lean = np.tan(np.radians(degrees))
        built = scene("plate", [quad("plate", (-1, -1, -lean), (2, 0, 2 * lean), (0, 2, 0))], [grey(0.8)],
                      [spot((0.0, 0.0, 2.0), (0, 0, 0), 1.0, 50.0)], volumes=[volume((-1, -1, -1), (1, 1, 1), (4, 4, 4))])
        field = bench.bake(built, **_coarse(bench))
        x, y = (grid.ravel() for grid in np.meshgrid(*[np.linspace(-0.5, 0.5, 5)] * 2))
        normal = np.array([-lean, 0.0, 1.0]) / np.hypot(lean, 1.0)
        points = np.stack([x, y, lean * x], axis=1).astype(np.float32)
        found = brightness(field, points, np.tile(normal, (25, 1)).astype(np.float32))
        # The lamp gives the middle 1/4 W/m² times the cosine, of which the plate sends out the albedo's share.
        samples.append(Sample(f"leaning {degrees:g} degrees", float(found.mean() / (0.8 * 0.25 * normal[2])), built, field))
    return samples


def _spreading(bench: Bench) -> list[Sample]:
    """The error of one bounce from a lit spot on the floor at points ever farther up the walls of a black room."""
    floor = quad("floor", (-1, -1, -0.999), (2, 0, 0), (0, 2, 0), material=1)
    built = scene("lit floor", [box("room", -ONE, ONE, inward=True), floor], [grey(0.0, name="black"), grey(0.8, name="floor")],
                  [spot((-0.3, -0.3, 0.9), (-0.3, -0.3, -1.0), 4.0, 40.0)], volumes=[volume(-ONE, ONE, (4, 4, 4))])
    field, context = bench.bake(built, **_coarse(bench)), LightContext(built, bench.threads)
    samples = []
    for height in (0.25, 0.75, 1.25, 1.75):
        along = np.linspace(-0.8, 0.8, 9)
        points = np.concatenate([np.stack([along, np.full(9, 1.0), np.full(9, height - 1)], 1),
                                 np.stack([np.full(9, -1.0), along, np.full(9, height - 1)], 1)]).astype(np.float32)
        normals = np.repeat(np.float32([[0, -1, 0], [1, 0, 0]]), 9, axis=0)
        exact = irradiance_at(context, points, normals, 1024, seed=REFERENCE_SEED)
        samples.append(Sample(f"{height:g} m up", relative_rmse(field.irradiance(points, normals), exact.mean,
                                                               exact.standard_error**2), built, field))
    return samples


_SWEEPS = {
    "resolution": {"probes": ("texel_size", (0.3, 0.15, 0.07)), "vpl": ("lights", (128, 512, 2048)),
                   "rsm": ("resolution", (64, 128, 256)), "lpv": ("resolution", (10, 16, 24))},
    "step-size": {"probes": ("rays", (64, 256, 1024)), "vpl": ("candidates", (2, 8, 32)), "rsm": ("samples", (50, 200, 800)),
                  "lpv": ("steps", (32, 64, 128, 256))},
}


def _sweep(kind: str):
    def measure(bench: Bench) -> list[Sample]:
        built, (points, normals) = room_with_block(), receivers(-ONE, ONE, 4)
        name, values = _SWEEPS[kind][bench.technique]
        settings = {key: value for key, value in _coarse(bench).items() if key not in (name, "error" if name == "rays" else "")}
        fields = [bench.bake(built, **{**settings, name: value}) for value in values]
        means = [brightness(field, points, normals).mean() for field in fields]
        return [Sample(f"{name} {value:g}", float(abs(mean / means[-1] - 1.0)), built, field)
                for value, mean, field in zip(values[:-1], means[:-1], fields[:-1], strict=True)]

    return measure


def _coarse(bench: Bench) -> dict:
    return {"probes": {"error": 0.02}, "vpl": {"lights": 1024, "candidates": 4}, "rsm": {"resolution": 256},
            "lpv": {"map_resolution": 64, "steps": 256}}[bench.technique]


# The other ways to read the same probes: each is better for some light and worse for other.
READINGS = tuple(Variant(f"read as {name}", {LOOKUP: {"reconstruction": name}}) for name in ("linear", "geomerics", "zh3"))

CASES = (
    Case("near-one-albedo", "light lost or made where walls are bright", "an integrating sphere with a lamp off its centre",
         "deviation of the wall's mean irradiance from albedo/(1 - albedo) times the direct light", "the albedo", 0.02,
         _near_one_albedo),
    Case("emitter-size", "noise and bias as an emitter shrinks", "a room lit by a panel of constant power",
         "relative RMSE on floor and walls against path tracing", "the panel's width", 0.1, _emitter_size,
         {"probes": READINGS}),
    Case("one-direction", "ringing and blur of light from one direction", "a black room with one small lit patch",
         "RMS error over all normals at a probe, over the patch's irradiance", "the SH order", 0.05, _one_direction,
         {"probes": READINGS}),
    Case("negative-light", "negative light where an engine reads SH as they are", "a black room with one small lit patch",
         "the lowest irradiance below zero, over the patch's", "the SH order", 0.05, _negative_light),
    Case("fireflies", "bright spots near corners", "a room with a block",
         "how much brighter than path tracing the brightest of 80 points is", "distance from the edges", 0.2, _fireflies,
         {"vpl": (Variant("no clamp", {"clamp": 0.0}), Variant("bound at the mean irradiance", {"clamp": 113.0}),
                  Variant("clamp without compensation", {"compensation": False}))}),
    Case("lone-plate", "a surface lights itself", "a lit plate with nothing around it",
         "irradiance on the plate over its radiosity; the truth is 0", "how it leans", 0.01, _lone_plate,
         {"lpv": (Variant("without damping", {"dampening": False}),)}),
    Case("spreading", "light spreads as it travels", "a lit spot on the floor of a black room",
         "relative RMSE on the walls against path tracing", "height above the floor", 0.1, _spreading,
         {"probes": READINGS}),
    Case("resolution", "brightness that depends on resolution", "a room with a block",
         "deviation of the walls' mean irradiance from the finest's", "texels, virtual lights, map texels or cells", 0.03,
         _sweep("resolution")),
    Case("step-size", "brightness that depends on the number of steps or samples", "a room with a block",
         "deviation of the walls' mean irradiance from the largest number's", "rays, samples or steps", 0.03, _sweep("step-size")),
)
