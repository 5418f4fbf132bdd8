"""Bakes of the samples at default settings against Cycles (tests/references/build.py makes the references)."""

import json
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.cycles.reference import octahedral_directions  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate import metrics  # noqa: E402
from rtgi_addon.numerics import grid, sh  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
REFERENCES = {path.stem: path for path in sorted((ROOT / "tests/references").glob("*.npz"))}
# Cycles' bakes do not see the medium that they lie in: media are held to path tracing with null collisions instead.
IN_MEDIA = {"fog_hall", "media_box", "smoke"}
# Their materials are glossy: Cycles' probes see highlights and what mirrors throw, which no technique here follows.
GLOSSY = {"metal_shop", "wet_floor"}
# For pictures in a style: its light is sky_courtyard's and sun_window's over again.
STYLED = {"toon_street"}
# For lights that are switched: relit light is held to bakes under that light.
SWITCHED = {"evening_shop"}
SAMPLES = sorted({path.stem for path in (ROOT / "sample_blends").glob("*.blend")} - IN_MEDIA - GLOSSY - STYLED - SWITCHED)


def reference(name):
    with np.load(REFERENCES[name]) as data:
        return {key: data[key] for key in data.files}


def bake(name, **settings):
    """The one grid of the sample's bake, and its scene."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    scene = extract_scene()
    method = techniques.get("probes")
    (result,) = method.bake(scene, method.Settings(**settings), np.random.default_rng(0), Progress()).grids()
    return result, scene


def at_reference(result, known):
    """Coefficients (n, k, 3) and usability (n,) at the reference's lattice indices."""
    x, y, z = known["lattice_index"].T
    return result.sh[z, y, x], result.usable[z, y, x]


def bias_allowance(known, share):
    """``share`` plus what the reference's own noise can do to the bias (three standard errors)."""
    return share + 3 * float(np.sqrt(known["variance"][:, 0].sum()) / known["sh"][:, 0].sum())


def told_error(baked, known):
    """The relative RMSE of coefficients (n, k, 3) against the reference, and its standard error: a bake meets its target over all
    its probes, and a reference knows two dozen."""
    error = metrics.relative_rmse(baked, known["sh"], known["variance"])
    square = np.sum((baked - known["sh"])**2 - known["variance"], axis=(1, 2), dtype=np.float64)
    light = np.sum(known["sh"]**2, axis=(1, 2), dtype=np.float64)
    spread = np.sqrt(np.sum((square - error**2 * light)**2)) / light.sum()
    return error, spread / (2 * max(error, 1e-6))


def is_met(target, baked, known):
    """Whether nothing speaks against an error of ``target`` (two standard errors), and it is not far off in any case."""
    error, doubt = told_error(baked, known)
    return error - 2 * doubt <= target and error <= 1.3 * target


def test_a_target_that_is_missed_is_seen():
    rng = np.random.default_rng(0)
    known = {"sh": rng.normal(1.0, 0.1, (24, 9, 3)), "variance": np.zeros((24, 9, 3))}
    off = rng.normal(0.0, 1.0, (24, 9, 3))
    assert is_met(0.01, known["sh"] + 0.01 * off, known) and not is_met(0.01, known["sh"] + 0.013 * off, known)


def test_every_sample_has_a_reference():
    assert SAMPLES and list(REFERENCES) == SAMPLES


@pytest.mark.parametrize("name", SAMPLES)
def test_references_lie_on_the_lattice_of_their_sample(name):
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    known, (volume,) = reference(name), extract_scene().volumes
    assert tuple(known["resolution"]) == volume.resolution
    x, y, z = known["lattice_index"].T
    lattice = grid.lattice_points(volume.world_from_local, volume.resolution)
    assert np.allclose(lattice[z, y, x], known["points_world"], atol=1e-5)
    assert len(known["sh"]) >= 16 and np.isfinite(known["sh"]).all() and np.isfinite(known["variance"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLES)
def test_a_default_bake_agrees_with_cycles(name):
    known = reference(name)
    result, _ = bake(name)
    baked, usable = at_reference(result, known)
    assert usable.mean() > 0.9, "references are meant to lie in the open"
    bias = metrics.signed_bias(baked[usable], known["sh"][usable]).value
    assert is_met(0.01, baked[usable], {name: known[name][usable] for name in ("sh", "variance")})
    assert abs(bias) <= bias_allowance(known, 0.003)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cornell_box", "sky_courtyard", "sun_window"])
def test_a_tighter_target_is_met_too(name):
    known = reference(name)
    baked, usable = at_reference(bake(name, error=0.005)[0], known)
    assert is_met(0.005, baked[usable], {name: known[name][usable] for name in ("sh", "variance")})


def test_the_dark_room_is_exactly_black():
    result, scene = bake("two_rooms", rays=256)
    x = grid.lattice_points(scene.volumes[0].world_from_local, scene.volumes[0].resolution)[..., 0]
    assert (x > 0).sum() == (x < 0).sum() == x.size // 2
    assert not np.any(result.sh[x > 0])
    assert (result.sh[x < 0][:, 0] > 0).all()


@pytest.mark.parametrize("name", SAMPLES)
def test_ten_rays_are_enough_for_a_finite_answer(name):
    result, scene = bake(name, rays=16, cache_rays=8)
    assert result.sh.shape[:3] == tuple(reversed(scene.volumes[0].resolution))
    assert np.isfinite(result.sh).all() and np.isfinite(result.visibility).all()
    assert result.usable.any() and (result.sh[result.usable][:, 0].max() > 0)


def test_the_furnace_reference_is_the_closed_form():
    known = reference("furnace")
    exact = np.zeros_like(known["sh"])
    exact[:, 0] = 0.2 / (1 - 0.6) * np.sqrt(4 * np.pi)
    assert metrics.relative_rmse(known["sh"], exact) < 0.002


def test_the_integrating_sphere_reference_is_the_closed_form():
    """Radiance of the wall is ρ/π·(direct + Φ/(4πR²)·ρ/(1 − ρ)); a probe sees it along every direction."""
    known = reference("integrating_sphere")
    power, rho, lamp = 10.0, np.array((0.8, 0.5, 0.2)), np.array((0.3, 0.2, 0.4))
    centre = (np.arange(256) + 0.5) / 256 * 2 - 1
    directions = octahedral_directions(np.stack(np.meshgrid(centre, centre), axis=-1).reshape(-1, 2))
    weights = sh.evaluate(directions, 2) * (4 * np.pi / len(directions))
    for point, measured in zip(known["points_world"], known["sh"], strict=True):
        along = directions @ point
        distance = -along + np.sqrt(along**2 - point @ point + 1)
        wall = point + distance[:, None] * directions
        to_lamp = lamp - wall
        squared = (to_lamp**2).sum(axis=1)
        direct = power / (4 * np.pi * squared) * -(to_lamp * wall).sum(axis=1) / np.sqrt(squared)
        radiance = rho / np.pi * (direct[:, None] + power / (4 * np.pi) * rho / (1 - rho))
        assert np.linalg.norm(weights.T @ radiance - measured) / np.linalg.norm(measured) < 0.005


@pytest.mark.parametrize("name", SAMPLES)
def test_references_say_how_they_were_made(name):
    notes = json.loads(str(reference(name)["notes"]))
    assert notes["sample"] == name and notes["command"].endswith(f"tests/references/build.py {name}")
    assert notes["bounces"] >= 32 and notes["relative_standard_error"] < 0.006
