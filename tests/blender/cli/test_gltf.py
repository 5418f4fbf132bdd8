"""What Blender's glTF importer skips: hidden nodes are hidden, other extensions are told with where they stand."""

import base64
import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from rtgi_addon.blender.cli.open_file import open_file  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402


def write(path, nodes, materials=({},), used=(), required=(), mesh_extensions=None):
    """A glTF of one triangle per mesh: ``nodes`` may refer to mesh 0 with material 0, and mesh 1 with the last one."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    buffer = base64.b64encode(corners.tobytes()).decode()
    primitives = [{"attributes": {"POSITION": 0}, "material": index} for index in (0, len(materials) - 1)]
    content = {
        "asset": {"version": "2.0"}, "scene": 0, "nodes": nodes, "materials": list(materials),
        "scenes": [{"nodes": [index for index in range(len(nodes))
                              if not any(index in node.get("children", ()) for node in nodes)]}],
        "meshes": [{"primitives": [primitives[0]]}, {"primitives": [primitives[1]], "extensions": mesh_extensions or {}}],
        "buffers": [{"byteLength": corners.nbytes, "uri": f"data:application/octet-stream;base64,{buffer}"}],
        "bufferViews": [{"buffer": 0, "byteLength": corners.nbytes}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
    }
    if used or required:
        content["extensionsUsed"] = [*used, *required]
    if required:
        content["extensionsRequired"] = list(required)
    path.write_text(json.dumps(content))
    return path


HIDDEN = {"KHR_node_visibility": {"visible": False}}


@pytest.mark.parametrize("required", [False, True])
def test_nodes_that_are_switched_off_are_hidden_with_all_below_them(empty_blend, tmp_path, required):
    nodes = [{"mesh": 0, "name": "seen"}, {"mesh": 0, "name": "off", "extensions": HIDDEN},
             {"name": "group", "extensions": HIDDEN, "children": [3, 4]}, {"mesh": 0, "name": "below"},
             {"name": "between", "children": [5]}, {"mesh": 1, "name": "far below"},
             {"mesh": 1, "name": "on", "extensions": {"KHR_node_visibility": {"visible": True}}}]
    extension = {"required" if required else "used": ["KHR_node_visibility"]}
    told = open_file(str(write(tmp_path / "scene.gltf", nodes, **extension)))
    assert told == () and {instance.name for instance in extract_scene().instances} == {"seen", "on"}


def test_extensions_that_the_importer_does_not_know_are_told_by_object_and_material(empty_blend, tmp_path):
    nodes = [{"mesh": 0, "name": "plain"}, {"mesh": 1}, {"mesh": 0, "name": "bent", "extensions": {"EXT_bend": {"by": 1}}}]
    materials = [{"name": "paint"}, {"name": "glow", "extensions": {"EXT_glow": {"inner": {"glowTexture": {"index": 0}}}}}]
    path = write(tmp_path / "scene.gltf", nodes, materials, mesh_extensions={"EXT_fold": {}},
                 used=["EXT_bend", "EXT_glow", "EXT_fold", "EXT_nowhere", "KHR_xmp_json_ld", "KHR_materials_ior"])
    told = {omission.text.split()[2]: omission for omission in open_file(str(path))}
    assert set(told) == {"EXT_bend", "EXT_glow", "EXT_fold", "EXT_nowhere"}
    unnamed = next(obj.name for obj in bpy.data.objects if obj.type == "MESH" and obj.name not in {"plain", "bent"})
    assert told["EXT_bend"].objects == ("bent",) and told["EXT_fold"].objects == (unnamed,)
    assert told["EXT_glow"].materials == ("glow",) and told["EXT_glow"].objects == ()
    assert "the file as a whole" in told["EXT_nowhere"].text


def test_the_importer_is_left_as_it_was(empty_blend, tmp_path):
    import io_scene_gltf2
    open_file(str(write(tmp_path / "scene.gltf", [{"mesh": 0}])))
    assert not hasattr(io_scene_gltf2, "glTF2ImportUserExtension")
    with pytest.raises(BakeError, match="EXT_unheard"):
        open_file(str(write(tmp_path / "scene.gltf", [{"mesh": 0}], required=["EXT_unheard"])))
    assert not hasattr(io_scene_gltf2, "glTF2ImportUserExtension")
