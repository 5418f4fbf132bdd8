"""Programs of effects, described without a GPU."""

import numpy as np
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import registry
from rtgi_addon.preview.effects import has_shader
from rtgi_addon.preview.effects.programs import EFFECT_FRAME, TEXTURES, frame_values, parameter_values, pixel_program


def test_a_program_has_what_its_file_reads():
    found = 0
    for name, effect in registry().items():
        if not has_shader(name):
            continue
        parameters = effect.parameters(effect.Settings(), stage())
        program, found = pixel_program(name, parameters), found + 1
        assert program.is_compute and "light" in program.samplers and set(program.samplers) <= set(TEXTURES)
        struct = dict(program.uniforms)["effect"]
        assert {member[1] for member in struct.members} == set(parameters)
        assert len(struct.pack(**parameter_values(parameters))) % 16 == 0
    assert found


def test_the_frame_says_where_pixels_look():
    seen = view()
    values = frame_values(seen, SIZE, 3, (0.25, -0.5), True, np.eye(4))
    record = np.frombuffer(EFFECT_FRAME.pack(**values), EFFECT_FRAME.dtype)[0]
    assert record["index"] == 3 and record["transparent"] == 1 and tuple(record["size"]) == SIZE
    place = np.array([0.3, 0.6])
    direction = record["ray_base"] + place[0] * record["ray_across"] + place[1] * record["ray_up"]
    origin, towards, _ = seen.through(place[:1], place[1:], SIZE, (0.25, -0.5))
    assert np.allclose(direction / np.linalg.norm(direction), towards[0], atol=1e-6)
    clipped = np.append(origin[0] + 2 * towards[0], 1.0) @ record["clip_from_world"]
    assert np.allclose(clipped[:2] / clipped[3] * 0.5 + 0.5, place, atol=1e-5)


def test_an_effect_without_parameters_has_a_struct_all_the_same():
    program = pixel_program("mist", {})
    struct = dict(program.uniforms)["effect"]
    assert len(struct.pack(**parameter_values({}))) == 16
