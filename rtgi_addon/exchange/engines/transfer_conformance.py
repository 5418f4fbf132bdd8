"""What relighting is held to inside an engine: irradiance that `rtgi relight` and our own look-up give, in a dozen lightings.

Two sets: the ``kit``, whose tables are of every kind on the probes of `kit.py`, and the bundle's own. The tolerance is that of the
probes (`conformance.py`), twice, since GPUs may cut where numpy rounds, and besides what rounding a table to half floats can
change: 2^-11 of the sum of the magnitudes of what columns give. Where a probe rings, deringing follows what is rounded.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from ...numerics import dome, sh
from ...scene import World
from ...techniques.lattice.dilation import dilate
from ...techniques.lattice.field import ProbeField
from ...techniques.transfer.data import Transfer, TransferGrid
from ...techniques.transfer.lighting import DistantSun, Lighting, Sky, sun_from
from ...techniques.transfer.relight import relit
from .axes import Axes
from .conformance import BUNDLE, KIT, bundle_points, case, kit_points
from .kit import kit_field
from .transfer import engine_sky
from .volumes import held_field

SCHEMA = "rtgi-relight-conformance/1"
_HALF = 2.0**-11
# How far a probe's coefficients follow what is rounded, deringing among it, as a share of that.
_FOLLOWED = 1.0
_SIDE = 4
# What of a transfer is not by volume.
_OF_ALL = "order", "sky_order", "sun_side", "sun_below", "lights", "sites", "world"


@cache
def kit_transfer() -> Transfer:
    """Tables of three lights, nine harmonics and twice 16 suns, for the probes of the kit."""
    grids, rng = [], np.random.default_rng(21)
    for grid in kit_field().grids():
        shape = grid.sh.shape[:3]
        suns = 2 * _SIDE * _SIDE

        def matrices(count: int, shape=shape, grid=grid, rng=rng) -> np.ndarray:
            # Light from one side, so that many sums ring, and dark columns too.
            values = rng.normal(size=(*shape, 9, count, 3)) * np.array([0.5, 0.9, 0.5])[sh.bands(2)][:, None, None]
            values[..., 0, :, :] = np.abs(values[..., 0, :, :]) + 0.3
            values *= np.exp(rng.normal(size=(1, 1, 1, 1, count, 3)))
            filled = dilate(replace(grid, sh=values.reshape(*shape, 9, -1).astype(np.float32))).sh
            return np.ascontiguousarray(np.moveaxis(filled.reshape(*shape, 9, count, 3), -1, 0))

        sky = dilate(replace(grid, sh=(0.3 * rng.normal(size=(*shape, 9, 9)) + 0.5 * np.eye(9)).astype(np.float32))).sh
        seen = dilate(replace(grid, sh=rng.random((*shape, 1, suns)).astype(np.float32))).sh[:, :, :, 0]
        bounce = 0.1 * matrices(9)
        grids.append(TransferGrid(grid, sky, bounce, 0.2 * matrices(suns), seen, matrices(3),
                                  np.zeros((3, *shape, 9, 0), np.float32)))
    lights = ("world", "world"), ("suns", "suns"), ("Lamps", "group")
    return Transfer(tuple(grids), 2, 2, _SIDE, True, lights, np.zeros((0, 3)), World.constant(1.0))


def lightings(transfer: Transfer) -> list[tuple[str, Lighting, Sky | None]]:
    """A dozen lightings that ``transfer`` can have, with their skies."""
    groups = [name for name, kind in transfer.lights if kind == "group"]
    dim = {name: np.array([0.25, 0.5, 2.0]) for name in groups[:1]}
    off = {name: np.zeros(3) for name in groups}
    noon, late = sun_from(170.0, 61.0, [3.0, 2.9, 2.7]), sun_from(262.0, 7.0, [2.0, 1.2, 0.5])
    node = DistantSun(transfer.sun_directions[len(transfer.sun_directions) // 3], np.full(3, 2.0))
    grey = _sky(transfer, [0.5])
    blue = _sky(transfer, [[0.9, 1.4, 2.4], [0.1, 0.1, 0.0], [0.4, 0.5, 0.9], [-0.2, 0.1, 0.3]])
    spots = Sky(blue.coefficients, _spots(transfer))
    dark = Lighting(World.constant(0.0), (), off)
    return [
        ("as it was baked", Lighting(), None),
        ("a sun at noon", Lighting(suns=(noon,)), None),
        ("a late sun", Lighting(suns=(late,)), None),
        ("a sun in a direction of the table", Lighting(suns=(node,)), None),
        ("a sun on the horizon", Lighting(suns=(sun_from(90.0, 0.0, [1.0, 0.6, 0.3]),)), None),
        ("a sun below the horizon", Lighting(suns=(sun_from(30.0, -20.0, [1.0, 1.0, 1.0]),)), None),
        ("two suns", Lighting(suns=(noon, late)), None),
        ("an overcast sky", Lighting(World.constant(0.5), ()), grey),
        ("a clear sky", Lighting(World.constant(0.5)), blue),
        ("a sky with bright spots", Lighting(World.constant(0.5), ()), spots),
        ("night with groups dimmed", replace(dark, groups={**off, **dim}), _sky(transfer, [0.0])),
        ("all of it", Lighting(World.constant(0.5), (noon, late), dim), spots),
    ]


def to_json(field: ProbeField, transfer: Transfer, axes: Axes) -> dict:
    """The contents of an export's conformance for relighting; ``field`` is an ``engine_field``."""
    return {"schema": SCHEMA, "unit": "W/m^2", "sets": [_kit_set(axes), _set(BUNDLE, field, transfer, axes)]}


@cache
def _kit_set(axes: Axes) -> dict:
    return _set(KIT, kit_field(), kit_transfer(), axes)


def _set(name: str, field: ProbeField, transfer: Transfer, axes: Axes) -> dict:
    rng = np.random.default_rng(22)
    points = kit_points(rng) if name == KIT else bundle_points(field, rng)
    entries, asked = [], None
    for number, (label, lighting, sky) in enumerate(lightings(transfer)):
        held = held_field(relit(transfer, lighting, sky))
        found = case(label, "", name, held, axes, points, np.random.default_rng(23), more=_rounding(held, transfer, lighting, sky))
        if number == 0:
            asked = found.to_json()
        entries.append({"name": label, "light": light_json(transfer, lighting, sky, axes),
                        **{key: found.to_json()[key] for key in ("irradiance", "tolerance")}})
    return {"volumes": name, **{key: asked[key] for key in ("points", "normals", "surface_normals")}, "cases": entries}


def light_json(transfer: Transfer, lighting: Lighting, sky: Sky | None, axes: Axes) -> dict:
    """``lighting`` as a loader takes it."""
    suns = None if lighting.suns is None else [
        {"towards": axes.directions(np.asarray(sun.towards, np.float64)).tolist(),
         "irradiance": np.asarray(sun.irradiance).tolist()} for sun in lighting.suns]
    return {"suns": suns, "sky": None if sky is None else engine_sky(sky, axes),
            "factors": {name: np.asarray(factor, np.float64).tolist() for name, factor in lighting.groups.items()}}


def _rounding(held: ProbeField, transfer: Transfer, lighting: Lighting, sky: Sky | None) -> ProbeField:
    """A field whose coefficients are what rounding of tables can change: by magnitudes, of probes as ``held`` has them."""
    absolute = Transfer(tuple(
        replace(grid, **{name: np.abs(getattr(grid, name)) for name in ("sky", "bounce", "suns", "seen", "lights", "local")})
        for grid in transfer.grids), *(getattr(transfer, name) for name in _OF_ALL))
    sky = None if sky is None else Sky(np.abs(sky.coefficients), np.abs(sky.suns))
    lighting = replace(lighting, suns=None if lighting.suns is None else tuple(
        DistantSun(sun.towards, np.abs(sun.irradiance)) for sun in lighting.suns))
    by_name = {grid.volume.name: grid for grid in relit(absolute, lighting, sky)}
    return ProbeField(tuple(replace(grid, sh=_FOLLOWED * _HALF * np.abs(by_name[grid.volume.name].sh[..., :9, :]))
                            for grid in held.grids()), lookup=replace(held.lookup, reconstruction="linear"))


def _sky(transfer: Transfer, rows) -> Sky:
    coefficients = np.zeros((sh.coefficient_count(transfer.sky_order), 3), np.float32)
    rows = np.broadcast_to(np.asarray(rows, np.float32).reshape(len(rows), -1), (len(rows), 3))[:len(coefficients)]
    coefficients[:len(rows)] = rows
    return Sky(coefficients, np.zeros((len(transfer.sun_directions), 3), np.float32))


def _spots(transfer: Transfer) -> np.ndarray:
    """What harmonics leave of a sky: bright in some directions, too bright in all others."""
    suns = np.full((len(transfer.sun_directions), 3), -0.4 / len(transfer.sun_directions), np.float32)
    index, share = dome.weights(np.array([[0.6, 0.0, 0.8], [-0.48, 0.6, 0.64]]), transfer.sun_side, transfer.sun_below)
    np.add.at(suns, index.ravel(), share.ravel()[:, None] * np.float32([0.9, 0.6, 0.3]))
    return suns
