"""Everything that is wrong with real files and still has to bake."""

import bpy
import numpy as np

from . import kit


def adversarial():
    """A closed room full of broken things: a bake must finish, warn about each by name, and be right about the rest.

    Non-manifold and open meshes, inside-out boxes, zero-area faces, loose edges, an empty mesh, a missing image, a mirrored
    and sheared object, an albedo of exactly 1, and a partition whose faces lie exactly on a plane of the probe lattice.
    """
    plaster = kit.material("Plaster", (0.7, 0.7, 0.7))
    blue = kit.material("Blue", (0.2, 0.3, 0.6))
    kit.cavities("Room", (-2.1, -2.1, -0.1), (2.1, 2.1, 2.5), [((-2.0, -2.0, 0.0), (2.0, 2.0, 2.4))],
                 dict.fromkeys(kit.BOX_FACES, plaster))
    # The lattice has planes at x = −1.5, −0.5, 0.5, 1.5: this sheet without thickness lies exactly on one of them.
    kit.mesh_object("Sheet on the Lattice", [(0.5, -2.0, 0.0), (0.5, 0.2, 0.0), (0.5, 0.2, 1.6), (0.5, -2.0, 1.6)],
                    [(0, 1, 2, 3)], blue)
    inside_out = kit.mesh_object("Inside Out", kit.box_vertices((-1.9, 1.1, 0.002), (-1.2, 1.8, 0.7)),
                                 [tuple(reversed(face)) for face in kit.BOX_FACES.values()], blue)
    inside_out.rotation_euler.z = 0.05
    faces = list(kit.BOX_FACES.values())
    kit.mesh_object("Half Flipped", kit.box_vertices((-0.4, 1.2, 0.002), (0.2, 1.8, 0.9)),
                    [face if i % 2 else tuple(reversed(face)) for i, face in enumerate(faces)], blue)
    fins = [(0, 0, 0), (0, 0, 0.8), (0.5, 0, 0), (0.5, 0, 0.8), (-0.4, 0.3, 0), (-0.4, 0.3, 0.8),
            (-0.2, -0.45, 0), (-0.2, -0.45, 0.8)]
    non_manifold = kit.mesh_object("Three Fins on One Edge", fins, [(0, 2, 3, 1), (0, 4, 5, 1), (0, 6, 7, 1)], plaster)
    non_manifold.location = (1.2, 1.2, 0.002)
    kit.box("Open Box", (-1.8, -1.8, 0.002), (-1.1, -1.1, 0.6), kit.material("Red", (0.6, 0.1, 0.08)), without=("+z",))
    degenerate_mesh(plaster)
    kit.box("Albedo One", (-0.6, -0.3, 0.002), (-0.1, 0.2, 0.6), kit.material("Whiter than Real", (1.0, 1.0, 1.0)), turn=0.3)
    mirrored = kit.mesh_object("Mirrored and Sheared", kit.box_vertices((-0.3, -0.3, 0.0), (0.3, 0.3, 0.6)), faces, blue)
    parent = kit.link(bpy.data.objects.new("Uneven Parent", None))
    parent.location, parent.scale = (1.3, -1.2, 0.002), (-1.0, 0.6, 1.2)
    mirrored.parent, mirrored.rotation_euler.z = parent, 0.6
    missing_image()
    kit.link(bpy.data.objects.new("Empty Mesh", bpy.data.meshes.new("Empty Mesh")))
    kit.lamp("Lamp", "POINT", (-0.2, 0.5, 2.1), 45.0, (1.0, 0.93, 0.85), shadow_soft_size=0.06)
    kit.probe_volume("Probes", (-2.0, -2.0, 0.0), (2.0, 2.0, 2.4), (4, 4, 3))
    kit.camera((-1.85, -1.9, 1.9), (0.4, 0.6, 0.6), lens=18.0)


def degenerate_mesh(coat) -> None:
    """A tilted quad together with faces without area (doubled points, points on a line) and edges without a face."""
    mesh = bpy.data.meshes.new("Degenerate")
    vertices = [(0, 0, 0), (0.6, 0, 0), (0.6, 0.5, 0.3), (0, 0.5, 0.3), (0.3, 0, 0), (0.6, 0, 0),
                (0.2, 0.9, 0.4), (0.9, 0.9, 0.4)]
    mesh.from_pydata(vertices, [(6, 7)], [(0, 1, 2, 3), (0, 4, 1), (1, 5, 2)])
    mesh.materials.append(coat)
    mesh.update()
    kit.link(bpy.data.objects.new("Degenerate Faces", mesh)).location = (-1.9, -0.4, 0.3)


def missing_image() -> None:
    """A panel whose picture is nowhere: Cycles shows its magenta."""
    image = bpy.data.images.new("not_there", 4, 4)
    image.source, image.filepath = "FILE", "//textures/not_there.png"
    coat = kit.material("Lost Picture", 0.8, image=image)
    kit.mesh_object("Panel with a Missing Image", [(-0.5, 1.99, 1.3), (0.5, 1.99, 1.3), (0.5, 1.99, 1.9), (-0.5, 1.99, 1.9)],
                    [(0, 1, 2, 3)], coat, uvs=np.array([(0, 0), (1, 0), (1, 1), (0, 1)]))
