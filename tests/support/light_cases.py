"""Small scenes of how Blender lets light be seen, linked and limited, each with what Cycles makes of it.

``CASES`` builds each into the open file; ``RIGHT`` has the mean radiance coefficient L00 (3,) over the probes by Cycles.
``python tests/support/light_cases.py [NAME …]`` renders the right values anew and prints them: an octahedral panorama a probe by
``blender.cycles.reference``, the mean of eight seeds, good to some 0.3 %.
"""

import bpy
import numpy as np

WHITE = (1.0, 1.0, 1.0)


def diffuse(name, color):
    """A material of one Diffuse BSDF, and its node tree."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def emissive(name, strength):
    """A material of one Emission."""
    material = diffuse(name, WHITE)
    tree = material.node_tree
    shader = tree.nodes.new("ShaderNodeEmission")
    shader.inputs["Strength"].default_value = strength
    tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material


def transparent(name, lets_light_through):
    """A material of one Transparent BSDF, with Transparent Shadows or without."""
    material = diffuse(name, WHITE)
    tree = material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    material.use_transparent_shadow = lets_light_through
    return material


def mesh(name, corners, faces, material, collection=None):
    """An object of ``faces`` over ``corners``."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(corners, [], faces)
    data.materials.append(material)
    obj = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def box(name, centre, size, material, inward=False, **where):
    """A box about ``centre``, seen from outside or from inside."""
    x, y, z = (np.array(size) / 2.0).tolist()
    corners = [(-x, -y, -z), (x, -y, -z), (x, y, -z), (-x, y, -z), (-x, -y, z), (x, -y, z), (x, y, z), (-x, y, z)]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    obj = mesh(name, corners, [face[::-1] for face in faces] if inward else faces, material, **where)
    obj.location = centre
    return obj


def square(name, z, half, material, **where):
    """A horizontal square."""
    corners = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    return mesh(name, corners, [(0, 1, 2, 3)], material, **where)


def room(color=(0.7, 0.7, 0.7)):
    """A closed room of 2 m, its floor at 0."""
    return box("room", (0, 0, 1), (2, 2, 2), diffuse("wall", color), inward=True)


def lid():
    """A dark square under the ceiling."""
    return square("lid", 1.5, 0.9, diffuse("dark", (0.05, 0.05, 0.05)))


def red_box(**where):
    """A red box on the floor."""
    return box("red box", (0, 0, 0.3), (1.2, 1.2, 0.5), diffuse("red", (0.8, 0.05, 0.05)), **where)


def lamp(kind="POINT", z=1.7, energy=50.0, **settings):
    """A lamp on the axis of the room."""
    data = bpy.data.lights.new("lamp", kind)
    data.energy = energy
    for name, value in settings.items():
        setattr(data, name, value)
    obj = bpy.data.objects.new("lamp", data)
    obj.location = (0, 0, z)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def volume(centre=(0, 0, 1), scale=(0.6, 0.6, 0.6)):
    """Eight probes."""
    data = bpy.data.lightprobes.new("probes", "VOLUME")
    data.resolution_x = data.resolution_y = data.resolution_z = 2
    obj = bpy.data.objects.new("probes", data)
    obj.location, obj.scale = centre, scale
    bpy.context.scene.collection.objects.link(obj)
    return obj


def link(light, kind, *objects, exclude=(), child=None):
    """Restrict what ``light`` lights ('receiver') or what shadows it ('blocker') to ``objects`` and to all of the collection
    ``child``, less ``exclude``."""
    collection = bpy.data.collections.new(kind)
    for obj in (*objects, *exclude):
        collection.objects.link(obj)
    for entry, obj in zip(collection.collection_objects, collection.objects, strict=True):
        entry.light_linking.link_state = "EXCLUDE" if obj in exclude else "INCLUDE"
    if child is not None:
        collection.children.link(child)
    setattr(light.light_linking, f"{kind}_collection", collection)


def dome_without_shadow():
    """A sun above a closed dome that casts no shadow."""
    square("ground", 0.0, 3.0, diffuse("ground", (0.6, 0.5, 0.4)))
    box("dome", (0, 0, 2), (8, 8, 6), diffuse("sky", (0.2, 0.4, 0.8)), inward=True).visible_shadow = False
    lamp("SUN", 9.0, 3.0).rotation_euler = (0.4, 0, 0)
    volume((0, 0, 1), (1, 1, 0.5))


def lid_hidden_from_diffuse():
    """What surfaces do not see, but a camera and shadow rays do."""
    room()
    lid().visible_diffuse = False
    lamp(z=1.8)
    volume((0, 0, 0.8), (0.6, 0.6, 0.4))


def _linked_lamp(kind, *names, **how):
    things = {"room": room((0.6, 0.6, 0.6)), "red box": red_box(), "lid": lid()}
    how = {name: tuple(things[part] for part in value) for name, value in how.items()}
    link(lamp(z=1.8), kind, *(things[name] for name in names), **how)
    volume((0, 0, 0.95), (0.6, 0.6, 0.3))


def lamp_lights_room_alone():
    """A lamp that leaves the red box out."""
    room_object = room((0.6, 0.6, 0.6))
    red_box()
    link(lamp(), "receiver", room_object)
    volume((0, 0, 1.2), (0.6, 0.6, 0.4))


def panel_lights_room_alone():
    """The same with an emissive mesh."""
    room_object = room((0.6, 0.6, 0.6))
    red_box()
    link(square("panel", 1.98, 0.4, emissive("panel", 10.0)), "receiver", room_object)
    volume((0, 0, 1.2), (0.6, 0.6, 0.4))


def lamp_lights_all_but_box():
    """A collection that only excludes."""
    _linked_lamp("receiver", exclude=("red box",))


def lamp_shadowed_by_room_alone():
    """A lid that is no blocker, and so casts no shadow."""
    _linked_lamp("blocker", "room")


def lamp_shadowed_by_all_but_lid():
    """The same said the other way round."""
    _linked_lamp("blocker", exclude=("lid",))


def panel_shadowed_by_room_alone():
    """A lid that throws no shadow of an emissive mesh."""
    room_object = room((0.6, 0.6, 0.6))
    lid()
    link(square("panel", 1.98, 0.4, emissive("panel", 10.0)), "blocker", room_object)
    volume((0, 0, 0.9), (0.6, 0.6, 0.4))


def lamp_lights_a_collection_but_one():
    """A child collection included, one object of it excluded."""
    child = bpy.data.collections.new("child")
    bpy.context.scene.collection.children.link(child)
    box("room", (0, 0, 1), (2, 2, 2), diffuse("wall", (0.6, 0.6, 0.6)), inward=True, collection=child)
    red = red_box(collection=child)
    link(lamp(), "receiver", exclude=(red,), child=child)
    volume((0, 0, 1.2), (0.6, 0.6, 0.4))


def lamp_lights_an_instanced_box():
    """A lamp that lights what an empty instances, by the name of the empty."""
    box("room", (0, 0, 1), (2, 2, 2), diffuse("wall", (0.6, 0.6, 0.6)), inward=True)
    made = bpy.data.collections.new("made")
    red_box(collection=made)
    empty = bpy.data.objects.new("empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", made
    bpy.context.scene.collection.objects.link(empty)
    link(lamp(), "receiver", empty)
    volume((0, 0, 1.2), (0.6, 0.6, 0.4))


def lamp_of_no_bounce():
    """Max Bounces 0: direct light, as the eye sees it."""
    room()
    lamp().data.cycles.max_bounces = 0
    volume()


def lamps_of_two_bounces_and_more():
    """Max Bounces 2 beside a lamp without a limit."""
    room()
    lamp().data.cycles.max_bounces = 2
    other = lamp(z=0.4, energy=10.0)
    other.data.color = (1.0, 0.5, 0.2)
    volume()


def pane_that_keeps_light():
    """A transparent material without Transparent Shadows."""
    room()
    lamp(z=1.8)
    square("pane", 1.5, 0.9, transparent("pane", False))
    volume((0, 0, 0.8), (0.6, 0.6, 0.3))


CASES = {case.__name__: case for case in (
    dome_without_shadow, lid_hidden_from_diffuse, lamp_lights_room_alone, panel_lights_room_alone, panel_shadowed_by_room_alone,
    lamp_lights_all_but_box, lamp_shadowed_by_room_alone, lamp_shadowed_by_all_but_lid, lamp_lights_a_collection_but_one,
    lamp_lights_an_instanced_box, lamp_of_no_bounce, lamps_of_two_bounces_and_more, pane_that_keeps_light)}
RIGHT: dict[str, tuple[float, float, float]] = {
    "dome_without_shadow": (0.7829, 0.8368, 1.6785),  # ± 0.0005
    "lid_hidden_from_diffuse": (2.0531, 2.0531, 2.0531),  # ± 0.0018
    "lamp_lights_room_alone": (4.1378, 3.2500, 3.2500),  # ± 0.0010
    "panel_lights_room_alone": (3.2654, 2.9948, 2.9948),  # ± 0.0006
    "lamp_lights_all_but_box": (0.2336, 0.1676, 0.1676),  # ± 0.0004
    "lamp_shadowed_by_room_alone": (1.6801, 0.9249, 0.9249),  # ± 0.0004
    "lamp_shadowed_by_all_but_lid": (1.6477, 0.9065, 0.9065),  # ± 0.0004
    "lamp_lights_a_collection_but_one": (4.1378, 3.2500, 3.2500),  # ± 0.0010
    "lamp_lights_an_instanced_box": (0.5413, 0.0306, 0.0306),  # ± 0.0003
    "lamp_of_no_bounce": (1.9530, 1.9530, 1.9530),  # ± 0.0000
    "lamps_of_two_bounces_and_more": (5.1353, 4.5542, 4.2055),  # ± 0.0009
    "pane_that_keeps_light": (3.4144, 3.4144, 3.4144),  # ± 0.0025
    "panel_shadowed_by_room_alone": (1.0696, 1.0696, 1.0696),  # ± 0.0002
}


def build(name):
    """An empty file with the case ``name`` in it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    CASES[name]()


def rendered(name):
    """L00 (3,) of the case by Cycles, and its standard error (3,)."""
    from rtgi_addon.blender.cycles.reference import CyclesSettings, render_probes, volume_points

    build(name)
    points = volume_points(bpy.context.scene)
    made = render_probes(points, CyclesSettings(order=0, resolution=32, samples=64, seeds=8))
    return made["sh"][:, 0].mean(axis=0), np.sqrt(made["variance"][:, 0].mean(axis=0) / len(points))


if __name__ == "__main__":
    import sys
    from pathlib import Path

    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    for wanted in sys.argv[1:] or CASES:
        right, noise = rendered(wanted)
        print(f'    "{wanted}": ({", ".join(f"{value:.4f}" for value in right)}),  # ± {noise.max():.4f}')
