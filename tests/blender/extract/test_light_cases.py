"""Ray visibility, linking and limits of light as Blender sets them, against what Cycles makes of them (see light_cases)."""

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

import light_cases as cases  # noqa: E402
import numpy as np  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.numerics.grid import lattice_points  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.techniques import registry  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.paths.reference import probe_sh  # noqa: E402

# One of each kind, for what takes longer.
KINDS = ("dome_without_shadow", "lid_hidden_from_diffuse", "lamp_lights_room_alone", "lamp_shadowed_by_all_but_lid",
         "panel_lights_room_alone", "panel_shadowed_by_room_alone", "lamps_of_two_bounces_and_more", "pane_that_keeps_light")


def read(name):
    """A case's scene and its right value (3,)."""
    cases.build(name)
    return extract_scene(), np.array(cases.RIGHT[name])


def baked(scene, technique, **settings):
    """Mean L00 (3,) over the probes of a bake."""
    technique = registry()[technique]
    field = technique.bake(scene, technique.Settings(**settings), np.random.default_rng(1), Progress())
    return field.grids()[0].sh[..., 0, :].reshape(-1, 3).mean(axis=0)


@pytest.mark.parametrize("name", sorted(cases.CASES))
def test_a_bake_of_probes_is_right(name):
    scene, right = read(name)
    np.testing.assert_allclose(baked(scene, "probes", order=0, error=0.02), right, rtol=0.025)


@pytest.mark.parametrize("name", KINDS)
def test_the_path_reference_is_right(name):
    scene, right = read(name)
    volume = scene.volumes[0]
    points = lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3).astype(np.float32)
    estimate = probe_sh(LightContext(scene), points, 0, 2048).mean[:, 0].mean(axis=0)
    np.testing.assert_allclose(estimate, right, rtol=0.03)


@pytest.mark.parametrize("name", KINDS)
def test_virtual_lights_are_right(name):
    scene, right = read(name)
    np.testing.assert_allclose(baked(scene, "vpl", order=0, lights=2048), right, rtol=0.05)
