"""What pictures show otherwise than bakes have it, by name."""

from dataclasses import replace

import scene_builders as build

from rtgi_addon.scene import Channel, drawn_otherwise


def test_surfaces_that_let_light_through_diffusely_are_named():
    scene = build.closed_box()
    assert drawn_otherwise(scene) == ""
    paper, leaf = (replace(build.material(name, 0.3), translucency=Channel.of(0.4)) for name in ("paper", "leaf"))
    said = drawn_otherwise(replace(scene, materials=(*scene.materials, paper, leaf, paper)))
    assert said == "pictures show the light that passes diffusely through paper, leaf as reflected"
