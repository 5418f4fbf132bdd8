"""What is followed by name, linking, roles, and what volumes capture, is no difference to Cycles, in a reading and in its bake."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material  # noqa: E402
from probe_bakes import bake  # noqa: E402

from rtgi_addon.blender.cli.open_file import known_properties  # noqa: E402
from rtgi_addon.blender.cycles.changes import changed  # noqa: E402
from rtgi_addon.blender.cycles.patches import CyclesPatches  # noqa: E402
from rtgi_addon.blender.cycles.receivers import CyclesReference  # noqa: E402
from rtgi_addon.blender.cycles.reference import CyclesSettings, render_probes  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.evaluate.verify import Suspect, replaced  # noqa: E402
from rtgi_addon.evaluate.verify.suspects import LAMP, OBJECT  # noqa: E402
from rtgi_addon.jobs.verify import verify  # noqa: E402
from rtgi_addon.numerics.grid import lattice_points  # noqa: E402

POWERS = {"linked": 60.0, "whole": 30.0, "torch": 200.0, "plain": 40.0}


def lamp(name, location):
    data = bpy.data.lights.new(name, "POINT")
    data.energy, data.shadow_soft_size = POWERS[name], 0.1
    obj = link(name, data)
    obj.location = location
    return obj


@pytest.fixture
def room(empty_blend):
    """A closed room with four lamps: one lights the block alone, one is baked whole, one not at all; and a red box that moves."""
    with known_properties():
        walls = link("walls", cube_mesh(size=2.0))
        walls.data.flip_normals()
        walls.data.materials.append(material("white", (0.6, 0.6, 0.6)))
        block = link("block", cube_mesh("block", 0.4))
        block.location = (0.9, 0.6, -1.5)
        block.data.materials.append(material("green", (0.1, 0.8, 0.1)))
        actor = link("actor", cube_mesh("actor", 0.6))
        actor.location = (-1.0, -0.8, -1.2)
        actor.data.materials.append(material("red", (0.9, 0.02, 0.02)))
        actor.rtgi.bake = "DYNAMIC"
        linked = lamp("linked", (0.5, -0.5, 1.2))
        linked.light_linking.receiver_collection = bpy.data.collections.new("lit")
        linked.light_linking.receiver_collection.objects.link(block)
        lamp("whole", (-0.6, 0.4, 1.3)).data.rtgi.bake = "ALL"
        lamp("torch", (0.0, 1.0, 0.5)).data.rtgi.bake = "NONE"
        lamp("plain", (0.2, 0.2, 1.6))
        probe = bpy.data.lightprobes.new("probes", "VOLUME")
        probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
        obj = link("probes", probe)
        obj.location = (0, 0, 0.4)
        yield bpy.context.scene


@pytest.mark.parametrize("capture", [{}, {"intensity": 2.0}, {"capture_indirect": False, "intensity": 3.0}],
                         ids=["all", "twice", "direct light alone"])
def test_a_reading_and_its_bake_agree(room, capture):
    """Within 3 %, whatever the volume captures: what it holds otherwise than Cycles' light is known to the path tracer."""
    for name, value in capture.items():
        setattr(bpy.data.lightprobes["probes"], name, value)
    scene = extract_scene()
    field = bake(scene, error=0.02)
    report = verify(scene, CyclesPatches(scene, 64), field, points=24, probes=4, paths=1024, within=0.03, most_suspects=0)
    assert report.agrees and report.as_read.figure.value < 0.03 and report.baked.figure.value < 0.03, report.to_text()
    if not scene.volumes[0].capture_bounces:
        return
    # Blind to roles it would not: the torch alone is as strong as all others together.
    bpy.data.lights["torch"].rtgi.bake = "BOUNCES"
    torch = extract_scene()
    assert not verify(torch, CyclesPatches(torch, 64), field, points=24, probes=4, paths=1024, within=0.03, most_suspects=0).agrees
    assert bpy.data.collections["lit"].objects.keys() == ["block"]


def test_cycles_references_know_the_roles_too(room):
    """Coefficients of the first band of what lamps bounce, within 3 %."""
    bpy.data.lights["whole"].rtgi.bake = "BOUNCES"
    scene = extract_scene()
    points = lattice_points(scene.volumes[0].world_from_local, scene.volumes[0].resolution).reshape(-1, 3)[:2]
    method = {} if bpy.app.build_options.cycles_osl else {"resolution": 32}
    theirs = render_probes(points, CyclesSettings(samples=64, **method), bpy.context.scene)["sh"]
    ours = np.concatenate([grid.sh.reshape(-1, 9, 3) for grid in bake(scene, error=0.02).grids()])[:2]
    np.testing.assert_allclose(ours[:, 0], theirs[:, 0], rtol=0.03)
    assert not any(obj.hide_render for obj in bpy.data.objects)


def test_a_reference_of_indirect_light_refuses_lamps_that_are_baked_whole(room):
    if not bpy.app.build_options.cycles_osl:
        pytest.skip("this Blender's Cycles has no OSL")
    with pytest.raises(BakeError, match="direct light of whole is baked"):
        CyclesReference()


def test_suspects_leave_linked_scenes_whole(room):
    """Without an object the others keep their links; a lamp that stands in for a linked one lights everything, in both."""
    scene = extract_scene()
    without = replaced(scene, (Suspect(OBJECT, "walls"),))
    linked = next(light for light in without.lights if light.name == "linked")
    names = [instance.name for instance in without.instances]
    assert [names[row] for row in np.flatnonzero(linked.linking.receivers)] == ["block"] and len(linked.linking.receivers) == 2
    suspect = (Suspect(LAMP, "linked"),)
    assert next(light for light in replaced(scene, suspect).lights if light.name == "linked").linking is None
    owner = bpy.data.objects["linked"].light_linking
    before = owner.receiver_collection
    with changed(room, scene, suspect):
        assert owner.receiver_collection is None
    assert owner.receiver_collection == before
