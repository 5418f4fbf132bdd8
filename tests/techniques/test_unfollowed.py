"""What techniques that work from maps say they do not follow: with names, of those surfaces alone that are met."""

from dataclasses import replace

import scene_builders as build

from rtgi_addon.scene import Channel
from rtgi_addon.techniques.unfollowed import surfaces_of_maps
from rtgi_addon.transport.context import LightContext


def test_surfaces_that_let_light_through_are_named():
    paper = replace(build.material("paper", 0.3), translucency=Channel.of(0.4))
    spare = replace(paper, name="spare")
    scene = build.scene([build.cube("room", inward=True), build.plane("sheet", 0.5, material_index=1)],
                        [build.material("wall"), paper, spare], [build.point_light()])
    said, = surfaces_of_maps("rsm", LightContext(scene))
    assert said.materials == ("paper",) and said.text == "rsm sends no light on through 'paper', which pass it diffusely"
    assert not list(surfaces_of_maps("rsm", LightContext(build.closed_box())))


def test_surfaces_that_cast_no_shadow_are_named():
    scene = build.closed_box()
    ghost = replace(scene.instances[0], name="ghost", visible_shadow=False)
    said, = surfaces_of_maps("lpv", LightContext(replace(scene, instances=(*scene.instances, ghost))))
    assert said.objects == ("ghost",) and said.text.startswith("lpv leaves 'ghost' unlit")
