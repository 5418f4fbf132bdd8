"""Lamps of a .glb in our units."""

import json
import struct

import numpy as np
import pytest

from rtgi_addon.exchange.engines.glb import correct


def content_of(path):
    data = path.read_bytes()
    magic, version, total = struct.unpack_from("<4sII", data)
    length, kind = struct.unpack_from("<I4s", data, 12)
    assert (magic, version, total, kind, length % 4) == (b"glTF", 2, len(data), b"JSON", 0)
    return json.loads(data[20:20 + length]), data[20 + length:]


def write(path, content):
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    rest = struct.pack("<I4s", 8, b"BIN\0") + b"geometry"
    path.write_bytes(struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest)
    return rest


def test_strengths_by_name(tmp_path):
    lights = [{"name": "Sun", "type": "directional", "intensity": 1}, {"name": "Other", "type": "point", "intensity": 3}]
    rest = write(tmp_path / "a.glb", {"asset": {"version": "2.0"}, "extensions": {"KHR_lights_punctual": {"lights": lights}}})
    correct(tmp_path / "a.glb", {"Sun": np.array([25.0, 20.0, 5.0]), "Unknown": np.ones(3)}, {})
    content, kept = content_of(tmp_path / "a.glb")
    sun, other = content["extensions"]["KHR_lights_punctual"]["lights"]
    assert sun == {"name": "Sun", "type": "directional", "intensity": 25.0, "color": [1.0, 0.8, 0.2]} and other == lights[1]
    assert kept == rest


def test_a_model_without_lamps(tmp_path):
    rest = write(tmp_path / "a.glb", {"asset": {"version": "2.0"}})
    correct(tmp_path / "a.glb", {"Sun": np.ones(3)}, {"Cube.001": "Cube"})
    assert content_of(tmp_path / "a.glb") == ({"asset": {"version": "2.0"}}, rest)


@pytest.mark.parametrize(("kind", "factor"), [("SUN", 1.0), ("POINT", 1 / (4 * np.pi)), ("SPOT", 1 / (4 * np.pi))])
def test_blenders_lamps_arrive_with_the_strength_they_are_baked_with(empty_blend, tmp_path, kind, factor):
    """With nodes, exposure and a colour, which Blender's exporter reads in its own way."""
    from rtgi_addon.blender.model import export_model
    bpy = empty_blend
    bpy.ops.object.light_add(type=kind)
    lamp = bpy.context.object.data
    lamp.name, lamp.energy, lamp.exposure, lamp.color = "Lamp", 7.0, 1.0, (1.0, 0.5, 0.25)
    lamp.use_nodes = True
    bpy.ops.mesh.primitive_cube_add()
    export_model(tmp_path / "a.glb")
    (light,) = content_of(tmp_path / "a.glb")[0]["extensions"]["KHR_lights_punctual"]["lights"]
    assert light["intensity"] == pytest.approx(14.0 * factor, rel=1e-5)
    np.testing.assert_allclose(light["color"], (1.0, 0.5, 0.25), rtol=1e-5)
