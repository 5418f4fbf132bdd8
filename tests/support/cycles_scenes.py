"""Small scenes for tests of what Cycles renders, and everything of a file that a render might change."""

import bpy


def grade_world(scene):
    """Give ``scene`` a world whose radiance is (1 + x, 1 + y, 1 + z) along direction (x, y, z); returns the scene."""
    scene.world = bpy.data.worlds.new("Graded")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    tree.nodes.clear()
    coordinates, add = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    add.inputs[1].default_value = (1.0, 1.0, 1.0)
    tree.links.new(coordinates.outputs["Generated"], add.inputs[0])
    tree.links.new(add.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    return scene


def lamp_in_a_box(scene):
    """A closed box of 2 m, Blender's default material, around a lamp of 40 W."""
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size = 40.0, 0.2
    scene.collection.objects.link(lamp)
    lamp.location, lamp.visible_camera = (0.3, 0.0, 0.5), True
    return lamp


def state(owner):
    """Every writable plain property of ``owner``, for comparison."""
    found = {}
    for item in owner.bl_rna.properties:
        if not item.is_readonly and item.type not in {"POINTER", "COLLECTION"} and item.identifier != "use_nodes":
            value = getattr(owner, item.identifier)
            found[item.identifier] = tuple(value) if hasattr(value, "__len__") and not isinstance(value, (str, set)) else value
    return found


def everything(scene):
    owners = (scene, scene.render, scene.render.image_settings, scene.cycles, scene.view_settings)
    return [state(owner) for owner in owners] + [scene.camera, *(state(obj) for obj in scene.objects),
                                                 [len(bpy.data.cameras), len(bpy.data.objects),
                                                  [image.name for image in bpy.data.images if image.type != "RENDER_RESULT"]]]
