"""Media in the frozen scene: what they say of themselves, what the pre-flight finds in them, what depends on them."""

from dataclasses import replace

import numpy as np
import pytest
from scene_builders import closed_box, cube
from scene_builders import transform as moved

from rtgi_addon.errors import BakeError
from rtgi_addon.jobs.fingerprint import fingerprint
from rtgi_addon.scene import ClosedMesh, DensityGrid, Medium, Phase, baked_part
from rtgi_addon.scene.capture import captured_light
from rtgi_addon.scene.checks import check_scene
from rtgi_addon.techniques.probes.settings import ProbeSettings
from rtgi_addon.transport.context import LightContext


def grid(density=1.0, matrix=None, **arrays):
    """A grid of 4 × 3 × 2 cells of one density over the box [−1, 1]³."""
    return DensityGrid(np.eye(4) if matrix is None else matrix, np.full((2, 3, 4), density, np.float32), **arrays)


def found(medium):
    """(severity, object, message) of what the pre-flight says of a box with ``medium``."""
    return [(finding.severity, finding.object, finding.message) for finding in check_scene(replace(closed_box(), media=(medium,)))]


def test_a_grid_says_its_resolution_as_volumes_do():
    assert grid().resolution == (4, 3, 2)


def test_extinction_is_what_is_scattered_and_absorbed():
    assert np.allclose(Medium("fog", np.array([1, 2, 3.0]), np.array([0.5, 0, 0.25])).extinction, [1.5, 2, 3.25])


def test_sound_media_are_clean():
    box = ClosedMesh(cube().vertices_local, cube().triangles, moved(scale=(0.5, 0.5, 0.5)))
    for medium in (Medium("world", np.ones(3)), Medium("box", np.ones(3), bounds=box), Medium("smoke", np.ones(3), grid=grid())):
        assert found(medium) == []


def test_a_glowing_medium_is_light_enough():
    dark = replace(closed_box(), lights=())
    assert [finding.severity for finding in check_scene(dark)] == ["error"]
    glow = Medium("fire", absorption=np.full(3, 0.1), emission=np.ones(3))
    assert check_scene(replace(dark, media=(glow,))) == []
    unlit = replace(glow, grid=grid(emission=np.zeros((2, 3, 4, 3), np.float32)))
    assert [finding.severity for finding in check_scene(replace(dark, media=(unlit,)))] == ["error"]


@pytest.mark.parametrize(("medium", "words"), [
    (Medium("smoke", np.ones(3), grid=grid(np.nan)), "NaN or infinity in its medium's grid of density"),
    (Medium("smoke", np.ones(3), grid=grid(-1.0)), "negative values in its medium's grid of density"),
    (Medium("smoke", np.array([1, np.inf, 1])), "NaN or infinity in its medium's scattering"),
    (Medium("smoke", absorption=np.array([1, -1, 1.0])), "negative values in its medium's absorption"),
    (Medium("smoke", np.ones(3), grid=grid(matrix=moved(scale=(1, 0, 1)))), "scaled to nothing"),
    (Medium("smoke", np.ones(3), grid=grid(matrix=np.full((4, 4), np.nan))), "NaN or infinity in its transform"),
    (Medium("smoke", np.ones(3), grid=DensityGrid(np.eye(4), np.zeros((0, 3, 4), np.float32))), "grid without cells"),
    (Medium("smoke", np.ones(3), phase=Phase(anisotropy=1.0)), "anisotropy of 1"),
])
def test_a_broken_medium_is_named_once(medium, words):
    findings = found(medium)
    assert [(severity, name) for severity, name, _ in findings] == [("error", "smoke")] and words in findings[0][2]


def test_a_bake_depends_on_media():
    def parts(*media):
        return fingerprint(replace(closed_box(), media=media), "probes", ProbeSettings(), 0)

    thin, thick = Medium("smoke", np.ones(3), grid=grid()), Medium("smoke", np.ones(3), grid=grid(2.0))
    changed = [name for name, value in parts(thin).items() if value != parts(thick)[name]]
    assert changed == ["media of the scene"] and parts() != parts(thin) == parts(replace(thin, grid=grid()))


def test_a_volume_captures_the_light_of_media_as_it_does_emission():
    glow = Medium("fire", emission=np.full(3, 2.0))
    scene = replace(closed_box(), media=(glow,))
    half = replace(scene.volumes[0], intensity=0.5)
    assert captured_light(scene, half).media[0].emission == pytest.approx([1.0] * 3)
    assert not captured_light(scene, replace(half, capture_emission=False)).media[0].is_emissive
    assert captured_light(scene, scene.volumes[0]) is scene


def test_what_no_bake_knows_is_in_none():
    scene = replace(closed_box(), media=(Medium("mist", np.ones(3)), Medium("veil", np.ones(3), bake="DYNAMIC")))
    assert [medium.name for medium in baked_part(scene).media] == ["mist"]


def test_relighting_asks_for_another_bake_once_a_medium_changed():
    before = replace(closed_box(), media=(Medium("fog", np.full(3, 0.1)),))
    context = LightContext(before)
    assert context.relit(replace(before, lights=())).scene.media == before.media
    with pytest.raises(BakeError, match="media have changed"):
        context.relit(replace(before, media=(Medium("fog", np.full(3, 0.2)),)))
