"""The kit: known content by closed forms, our own lookup's answers, and what it would notice."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.exchange.engines import conformance
from rtgi_addon.exchange.engines.axes import UNREAL, Y_UP
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.exchange.engines.volumes import engine_field, export_volumes, notes_on_order, to_half
from rtgi_addon.numerics import sh
from rtgi_addon.techniques.lattice import weights
from rtgi_addon.techniques.lattice.field import ProbeField

TINT = np.array([1.0, 0.5, 0.25])


@pytest.fixture(scope="module")
def field():
    return kit_field()


@pytest.fixture(scope="module")
def cases(field):
    return {case.name: case for case in conformance.cases(field, Y_UP)}


def asked(field, case):
    """What ``field`` says at the points and under both normals of ``case``."""
    back = Y_UP.engine_from_blender.astype(np.float32)
    points = case.points.astype(np.float64) @ Y_UP.engine_from_blender
    return field.irradiance(points, case.normals @ back, case.surface_normals @ back)


def test_two_hundred_points_each_under_two_normals(cases):
    assert set(cases) == {"known content", "between known probes", "visibility", "weights", "scattered", "bundle"}
    for case in cases.values():
        assert len(case.points) == len(case.normals) == len(case.irradiance) == (198 if case.name == "weights" else 200)
        for normals in (case.normals, case.surface_normals):
            assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
        cosine = np.sum(case.normals * case.surface_normals, axis=1)
        assert np.median(cosine) < 0.85 and (cosine > 0).mean() > 0.9


def test_a_constant_gives_pi_and_a_lobe_its_closed_form(cases):
    case = cases["known content"]
    constant = np.arange(200) % 16 == 0
    assert np.abs(case.irradiance[constant] - np.pi * TINT).max() < 1e-5
    # Probe 3 is the lobe 0.1 + max(0, d.z)^2 along Blender's z, which is the engine's y, its tint rolled by two.
    lobe = np.flatnonzero(np.arange(200) % 16 == 3)
    cosine = case.normals[lobe, 1]
    # Legendre coefficients of max(0, x)^2 are 1/6, 3/8 and 1/3; Funk and Hecke multiply them by pi, 2 pi / 3 and pi / 4.
    expected = 0.1 * np.pi + np.pi / 6 + np.pi / 4 * cosine + np.pi / 12 * (3 * cosine**2 - 1) / 2
    assert np.abs(case.irradiance[lobe] / np.roll(TINT, 2) - expected[:, None]).max() < 1e-3


def test_answers_are_those_of_our_own_lookup_in_blenders_axes(field, cases):
    for case in cases.values():
        assert np.abs(asked(field, case) - case.irradiance).max() < 1e-5 * case.irradiance.max()


def test_rounding_to_halves_stays_within_the_tolerance(field, cases):
    rounded = ProbeField([replace(grid, sh=grid.sh.astype(np.float16).astype(np.float32)) for grid in field.grids()])
    for case in cases.values():
        assert np.all(np.abs(asked(rounded, case) - case.irradiance) <= case.tolerance)
        assert np.median(case.tolerance / np.maximum(case.irradiance, 1e-3)) < 2e-3


def test_the_colours_of_weights_are_the_eight_weights(field, cases):
    """Of the lookup itself, block by block: kinds along y, then three times the same points for red, green and blue."""
    case, lookup = cases["weights"], field.lookups[[lookup.volume.name for lookup in field.lookups].index("Weights")]
    points = case.points.astype(np.float64) @ Y_UP.engine_from_blender
    _, weight = lookup.weights(points, case.surface_normals @ Y_UP.engine_from_blender.astype(np.float32))
    block = np.arange(198) // 22 % 3
    colours = case.irradiance / (np.sqrt(np.pi) / 2)
    for number, wanted in enumerate(((0, 1, 2), (3, 4, 5), (6, 7))):
        assert np.allclose(colours[block == number][:, :len(wanted)], weight[block == number][:, wanted], atol=1e-6)
    assert np.allclose(colours[block == 2, 2], 1.0, atol=1e-6)
    # All that decides about weights happens: nothing of a probe, all of it, and shares that only the floor leaves.
    smallest = weight.reshape(3, -1).min(axis=1)
    assert weight.max() > 0.9 and smallest[1] < 1e-9 and smallest[0] > 0


@pytest.mark.parametrize("change", [
    lambda grid: replace(grid, sh=grid.sh[..., ::-1]),
    lambda grid: replace(grid, sh=grid.sh * np.float32([1, -1, 1, 1, 1, 1, 1, 1, 1])[:, None]),
    lambda grid: replace(grid, sh=grid.sh * np.float32([1, 1, 1, 1, 1, 1, 1, 1, -1])[:, None]),
    lambda grid: replace(grid, validity=np.ones_like(grid.validity)),
    lambda grid: replace(grid, offset_world=0 * grid.offset_world),
    lambda grid: replace(grid, visibility=grid.visibility[..., ::-1, :]),
    lambda grid: replace(grid, sh=np.roll(grid.sh, 1, axis=2)),
], ids=["channels", "y", "x2-y2", "validity", "offsets", "tiles", "lattice"])
def test_the_kit_notices(field, cases, change):
    wrong = ProbeField([change(grid) for grid in field.grids()])
    case = cases["visibility"]
    assert np.any(np.abs(asked(wrong, case) - case.irradiance) > 10 * case.tolerance)


@pytest.mark.parametrize("name", ["SIDE_FLOOR", "CRUSH_BELOW", "UNSEEN_FLOOR"])
def test_the_kit_notices_a_number_that_is_off(field, cases, monkeypatch, name):
    monkeypatch.setattr(weights, name, 1.05 * getattr(weights, name))
    case = cases["weights"]
    assert np.any(np.abs(asked(field, case) - case.irradiance) > 3 * case.tolerance)


@pytest.mark.parametrize("name", ["visibility", "weights"])
def test_the_kit_notices_one_normal_for_the_other(field, cases, name):
    case = cases[name]
    for normals, surface_normals in ((case.normals, case.normals), (case.surface_normals, case.surface_normals)):
        wrong = asked(field, replace(case, normals=normals, surface_normals=surface_normals))
        if name == "visibility" or normals is case.normals:
            assert np.any(np.abs(wrong - case.irradiance) > 10 * case.tolerance)


def test_the_file_brings_floats_back(field, cases):
    stored = json.loads(json.dumps(conformance.to_json(field, Y_UP)))
    assert stored["schema"] == "rtgi-conformance/1"
    for entry, case in zip(stored["cases"], cases.values(), strict=True):
        assert np.array_equal(np.float32(entry["points"]), case.points)
        assert np.array_equal(np.float32(entry["irradiance"]), case.irradiance)


def test_volumes_are_what_the_lookup_reads_along_the_engines_axes(field):
    volumes = export_volumes(field, UNREAL)
    assert [volume.name for volume in volumes] == ["Inset", "Scattered", "Hard", "Weights", "Known"]
    for volume, lookup in zip(volumes, field.lookups, strict=True):
        nz, ny, nx = volume.live.shape
        lattice = np.stack(np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")[::-1], axis=-1).reshape(-1, 3)
        place = lattice @ volume.offset_from_lattice[:3, :3].T + volume.offset_from_lattice[:3, 3]
        # Those of scattered probes count from the centre.
        place = volume.offset.reshape(-1, 3) + (place if volume.words is None else 0.0)
        live = lookup.live | (volume.words is None)
        assert np.allclose(place[live], UNREAL.vectors(lookup.positions)[live], atol=1e-3 if volume.words is None else 0.1)
        assert np.allclose(volume.moments.reshape(-1, 2), lookup.moments * [100.0, 1e4])
        assert volume.bias == pytest.approx(100.0 * lookup.bias) and volume.tile == lookup.tile
        direction = np.array([[0.6, 0.0, 0.8]])
        ours = sh.evaluate(direction, 2) @ lookup.coefficients
        theirs = sh.evaluate(UNREAL.directions(direction), 2) @ volume.sh.reshape(-1, 9, 3)
        assert np.allclose(ours, theirs, atol=1e-5)


@pytest.mark.parametrize("order", [0, 1, 3])
def test_other_orders_are_brought_to_the_second(kit_bundle, order):
    def changed(grid):
        count = (order + 1) ** 2
        padded = np.zeros((*grid.sh.shape[:3], max(count, 9), 3), np.float32)
        padded[..., :9, :] = grid.sh
        padded[..., 9:, :] = 0.3
        return replace(grid, sh=padded[..., :count, :])

    bundle = replace(kit_bundle, grids=tuple(changed(grid) for grid in kit_bundle.grids))
    for grid, original in zip(engine_field(bundle).grids(), kit_bundle.grids, strict=True):
        kept = min((order + 1) ** 2, 9)
        assert grid.sh.shape[3] == 9 and np.array_equal(grid.sh[..., :kept, :], original.sh[..., :kept, :])
        assert not grid.sh[..., kept:, :].any()
    assert len(notes_on_order(bundle)) == (5 if order > 2 else 0)


def test_halves_have_a_largest_number():
    assert to_half(np.float32([65504.0, -1.0]), "it").dtype == np.float16
    with pytest.raises(BakeError, match="it is brighter than half floats hold"):
        to_half(np.float32([65600.0]), "it")
