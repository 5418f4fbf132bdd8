"""Groups of lights: switched to the digit, of lamps and of what emits."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from transfer_scenes import bake, room

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.progress import Progress
from rtgi_addon.scene import World
from rtgi_addon.techniques.transfer import one_for_all
from rtgi_addon.techniques.transfer.columns import materials_of
from rtgi_addon.techniques.transfer.lighting import Lighting, NewLamp
from rtgi_addon.techniques.transfer.relight import group_names, relit, site_shares
from rtgi_addon.techniques.transfer.settings import TransferSettings
from rtgi_addon.techniques.transfer.surfaces import require_surfaces

BLACK = World.constant(0.0)


@pytest.fixture(scope="module")
def field():
    return bake(room())


def test_what_shines_is_in_its_group(field):
    assert field.transfer.lights == (("suns", "suns"), ("Lamps", "group"), ("Neon", "group"), ("other", "group"))
    assert group_names(field.transfer) == ["Lamps", "Neon", "other"]


def test_a_group_that_is_dimmed_is_a_fresh_bake_to_the_digit(field):
    fresh = bake(room(lamp=0.25, glow=2.0))
    other = field.lit_by(Lighting(groups={"Lamps": np.full(3, 0.25), "Neon": np.full(3, 2.0)}))
    a, b = fresh.grids()[0].sh, other.grids()[0].sh
    assert np.abs(a - b).max() < 2e-6 * np.abs(a).max()


def test_groups_add_up_to_the_bake(field):
    whole = field.grids()[0].sh
    off = {name: np.zeros(3) for name in group_names(field.transfer)}
    parts = [relit(field.transfer, Lighting(world=BLACK, suns=(), groups={**off, name: np.ones(3)}))[0].sh for name in off]
    assert np.allclose(sum(parts), whole - field.transfer.grids[0].lights[..., 0].transpose(1, 2, 3, 4, 0), atol=1e-5)
    assert np.allclose(relit(field.transfer, Lighting())[0].sh, whole, atol=1e-6)


def test_a_group_takes_a_colour(field):
    off = {name: np.zeros(3) for name in group_names(field.transfer)}
    red = relit(field.transfer, Lighting(suns=(), groups={**off, "Lamps": np.array([1.0, 0.0, 0.0])}))[0].sh
    assert red[..., 0].any() and not red[..., 1:].any()


def test_an_unknown_group_is_refused_by_name(field):
    with pytest.raises(UsageError, match="there is no light group 'Neno': choose one of Lamps, Neon, other"):
        field.lit_by(Lighting(groups={"Neno": np.ones(3)}))


def test_the_same_seed_gives_the_same_bytes_for_any_threads():
    technique, scene = techniques.get("transfer"), room()
    settings = technique.Settings(rays=128, sun_side=3, sites=2)
    one, other = (technique.bake(scene, settings, np.random.default_rng(2), Progress(), threads=threads) for threads in (1, 3))
    assert all(values.tobytes() == other.arrays()[name].tobytes() for name, values in one.arrays().items())


def test_a_lamp_that_the_bake_did_not_know_lights_the_room(field):
    shares = site_shares(field.transfer, np.array([0.3, 0.1, 0.2]))
    assert shares.sum() == pytest.approx(1.0) and shares.min() >= 0
    lamp = NewLamp(np.array([0.5, 0.2, 1.0]), np.full(3, 4.0 * np.pi * 2.0))
    off = {name: np.zeros(3) for name in group_names(field.transfer)}
    mine = relit(field.transfer, Lighting(suns=(), groups=off, lamps=(lamp,)))[0].sh[..., 0, :]
    baked = relit(field.transfer, Lighting(suns=(), groups={**off, "Lamps": np.ones(3)}))[0].sh[..., 0, :]
    assert 0.6 < mine.mean() / baked.mean() < 1.6


def test_what_changed_of_the_surfaces_is_said(field):
    scene = room()
    require_surfaces(field.transfer, scene)
    require_surfaces(field.transfer, room(lamp=3.0, glow=0.5, sun=2.0))
    names = [item.name for item in scene.instances]
    painted = replace(scene, materials=(build.material(albedo=(0.1, 0.5, 0.4)), *scene.materials[1:]))
    wearers = sorted(repr(item.name) for item in scene.instances if 0 in materials_of(scene, item).values())
    with pytest.raises(BakeError, match=f"the scene's materials changed since the bake at {', '.join(wearers)}: bake"):
        require_surfaces(field.transfer, painted)
    other = replace(scene.instances[2], world_from_local=build.transform((0.5, 1, -1)))
    moved = replace(scene, instances=(*scene.instances[:2], other))
    with pytest.raises(BakeError, match=f"the scene's geometry changed since the bake at {names[2]!r}: bake"):
        require_surfaces(field.transfer, moved)
    swapped = replace(scene, instances=(*scene.instances[:2], replace(other, name="Aaa")))
    with pytest.raises(BakeError, match=rf"geometry changed since the bake at 'Aaa' \(new\), {names[2]!r} \(gone\): bake"):
        require_surfaces(field.transfer, swapped)
    before = {name: field.transfer.surfaces[name] for name in ("geometry", "materials")}
    with pytest.raises(BakeError, match="the scene's geometry changed since the bake: bake again"):
        require_surfaces(replace(field.transfer, surfaces=before), moved)


def test_settings_of_single_volumes_are_followed_by_all_or_named():
    settings = TransferSettings()
    first, second = (replace(room().volumes[0], name=name) for name in ("Hall", "Yard"))
    same = tuple(replace(volume, settings={"order": 1}) for volume in (first, second))
    assert one_for_all(same, settings) == (replace(settings, order=1), ())
    # What a volume captures is another matter, which is named by itself.
    assert one_for_all((first, replace(second, capture_world=False)), settings) == (settings, ())
    kept, named = one_for_all((first, same[1]), settings)
    assert kept == settings and [omission.objects for omission in named] == [("Yard",)] and "Yard" in str(named[0])
