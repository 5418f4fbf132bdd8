"""What is told of emissive surfaces that light others closer by than probes are apart."""

from dataclasses import replace

import numpy as np
import scene_builders as build

from rtgi_addon.jobs.report import lattice_warning
from rtgi_addon.progress import Progress
from rtgi_addon.scene.linking import Linking
from rtgi_addon.techniques import get
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.lattice.near_light import near_light
from rtgi_addon.techniques.lattice.near_notes import NearGlow, near_glow, notes_on
from rtgi_addon.transport.context import LightContext

WALL = (0.0, 0.92, 0.1)


def room(**places):
    """A closed room 2 m wide with probes half a metre apart, and glowing bars by name, 50 cm long, in it."""
    meshes = [build.cube("room", 1.0, inward=True), *(build.cube(name, 1.0, material_index=1) for name in places)]
    scene = build.scene(meshes, [build.material("wall", 0.5), build.material("glow", 0.0, 5.0)],
                        volumes=[build.volume(resolution=(4, 4, 4), half_size=1.0)])
    bars = [replace(item, world_from_local=build.transform(place, (0.25, 0.02, 0.03)))
            for item, place in zip(scene.instances[1:], places.values(), strict=True)]
    return replace(scene, instances=(scene.instances[0], *bars))


def told(scene, fitted=False):
    glow = near_glow(LightContext(scene, 1), scene.volumes, fitted)
    return glow, notes_on(glow)


def with_mesh(scene, number, mesh):
    """``scene`` with the mesh of its instance ``number`` replaced."""
    return replace(scene, meshes=(*scene.meshes[:number], mesh, *scene.meshes[number + 1:]))


def test_a_bar_by_the_wall_is_named_and_one_far_away_is_not():
    scene = room(tube=WALL, centre=(0.0, 0.0, 0.1))
    technique = get("probes")
    field = technique.bake(scene, technique.Settings(rays=256), np.random.default_rng(1), Progress())
    note, = field.notes
    assert note.startswith("light of tube falls on surfaces closer by") and "RTGI draws it at each pixel, engines" in note
    assert field.stats["near_emitters"] == {"at_pixels": ["tube"], "blurred": []}
    assert near_light(LightContext(scene, 1, whole=True), field).names == ("tube",)
    # A bake in parts says it when it is prepared.
    settings = technique.Settings(rays=256)
    assert technique.blocks.prepare(scene, settings, np.random.default_rng(1), Progress()).notes == field.notes
    off = ProbeField(field.grids(), stats={**field.stats, "error_on_surfaces": {"value": 9.0, "low": 8.0, "high": 10.0}})
    assert "RTGI's pictures then no longer draw what glows close by" in lattice_warning(off)


def test_nothing_is_told_where_nothing_glows_close_by():
    assert told(room(centre=(0.0, 0.0, 0.1))) == (NearGlow(), ())
    blind = room(tube=WALL)
    blind = replace(blind, volumes=(replace(blind.volumes[0], capture_emission=False),))
    assert told(blind) == (NearGlow(), ())


def test_what_is_too_fine_or_uneven_is_named_as_shown_blurred():
    scene = room(tube=WALL, ball=(0.0, -0.92, 0.1), sign=(0.92, 0.0, 0.1))
    scene = with_mesh(scene, 2, build.sphere("ball", 1.0, 3, material_index=1))
    assert len(scene.meshes[2].triangles) > 256
    uneven = replace(scene.materials[1], emission=replace(scene.materials[1].emission, attribute="glow"))
    sign = replace(scene.meshes[3], triangle_material=np.full_like(scene.meshes[3].triangle_material, 2),
                   attributes={"glow": np.full((len(scene.meshes[3].triangles), 3, 4), 0.5, np.float32)})
    scene = replace(with_mesh(scene, 3, sign), materials=(*scene.materials, uneven))
    glow, (note,) = told(scene)
    assert glow.at_pixels == ("tube",) and set(glow.blurred) == {"ball", "sign"}
    assert "not that of ball, sign" in note or "not that of sign, ball" in note
    alone = replace(scene, instances=(scene.instances[0], *scene.instances[2:]))
    glow, (note,) = told(alone)
    assert glow.at_pixels == () and "show it so, for only what shines evenly" in note


def test_panes_beyond_the_most_are_named():
    bars = {f"bar{number}": (0.0, 0.92, -0.9 + 0.15 * number) for number in range(12)}
    glow, (note,) = told(room(**bars))
    # Six faces each, of 64.
    assert len(glow.at_pixels) == 10 and len(glow.blurred) == 2 and not set(glow.at_pixels) & set(glow.blurred)
    assert f"not that of {', '.join(glow.blurred)}" in note and "… (+7) falls" in note


def test_many_small_ones_are_named_together():
    bulb = room(tube=WALL)
    grid = np.stack(np.meshgrid(np.linspace(-0.9, 0.9, 36), np.linspace(-0.9, 0.9, 36)), axis=-1).reshape(-1, 2)
    bulbs = [replace(bulb.instances[1], name=f"bulb{number}", world_from_local=build.transform((x, 0.97, z), (0.01, 0.01, 0.01)))
             for number, (x, z) in enumerate(grid)]
    glow, _ = told(replace(bulb, instances=(bulb.instances[0], *bulbs)))
    # Less than a thousandth of all light each.
    assert not glow.at_pixels and len(glow.blurred) > 1200
    far = [replace(item, world_from_local=build.transform((x, 0.0, z), (0.01, 0.01, 0.01)))
           for item, (x, z) in zip(bulbs[::100], 0.4 * grid[::100], strict=True)]
    assert told(replace(bulb, instances=(bulb.instances[0], *far)))[0] == NearGlow()


def test_what_keeps_the_whole_scene_from_it_is_told():
    scene = room(tube=WALL)
    linked = replace(scene.instances[1], linking=Linking(np.ones(2, bool), None))
    dim = replace(scene, volumes=(replace(scene.volumes[0], intensity=0.5),))
    for case, fitted, why in ((scene, True, "probes are fitted"), (dim, False, "a volume does not capture all light"),
                              (replace(scene, instances=(scene.instances[0], linked)), False, "light is linked to objects")):
        glow, (note,) = told(case, fitted)
        assert glow == ((), ("tube",), why) and f"show it so, for {why} (" in note
