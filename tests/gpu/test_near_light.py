"""What emissive surfaces give others close by, in the preview against its numpy and in the shade."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from effect_frames import drawn_frame
from picture_stage import view

from rtgi_addon.effects.picture import draw_picture
from rtgi_addon.progress import Progress
from rtgi_addon.techniques import get
from rtgi_addon.techniques.lattice.near_light import near_light
from rtgi_addon.transport.context import LightContext

SIZE, SEEN = (40, 26), view((0.0, -0.9, 0.1), lens=1.0)


def room(*plates):
    """A room with a glowing bar 6 cm off a wall, and black plates of the given places and sizes."""
    black = [build.cube(f"plate {index}", 1.0, material_index=2) for index in range(len(plates))]
    scene = build.scene([build.cube("room", 1.0, inward=True), build.cube("bar", 1.0, material_index=1), *black],
                        [build.material("wall", 0.5), build.material("glow", 0.0, 5.0), build.material("black", 0.0)],
                        volumes=[build.volume(resolution=(4, 4, 4), half_size=1.0)])
    places = [((0.0, 0.92, 0.1), (0.5, 0.02, 0.03)), *plates]
    placed = [replace(item, world_from_local=build.transform(*place))
              for item, place in zip(scene.instances[1:], places, strict=True)]
    return replace(scene, instances=(scene.instances[0], *placed))


def baked(scene):
    technique = get("probes")
    return technique.bake(scene, technique.Settings(rays=256), np.random.default_rng(1), Progress())


def shown(scene, field, frames=1):
    """The renderer's mean irradiance (h, w, 3) of so many frames, and its last sample."""
    from rtgi_addon.preview.renderer import PreviewRenderer
    result = PreviewRenderer(scene, field, None, ("irradiance",))
    for _ in range(frames):
        result.frame(SEEN, SIZE)
    return result, result.image("irradiance")[..., :3], drawn_frame(result, result.image("irradiance"), SEEN)


def seen_at(frame):
    where = frame.gbuffer.seen
    return where, *(getattr(frame.gbuffer, name)[where][:, :3] for name in ("position", "normal", "geometry"))


def test_with_nothing_in_the_way_it_is_the_closed_form(gpu_device):
    scene = room()
    field = baked(scene)
    _, _, frame = shown(scene, field)
    near = near_light(LightContext(scene, 1, whole=True), field)
    seen, points, normals, _ = seen_at(frame)
    expected = near.left.irradiance(points, normals) + near.panes.irradiance(points, normals)
    on_walls = frame.gbuffer.instance[seen] == 0
    assert on_walls.sum() > 500 and expected[on_walls].max() > 5 * field.irradiance(points, normals)[on_walls].max() / 2
    found = frame.irradiance[seen][:, :3]
    assert np.abs(found - expected)[on_walls].max() < 2e-3 * expected.max()


def test_shade_is_where_rays_find_it(gpu_device):
    scene = room(((0.0, 0.85, 0.2), (0.7, 0.15, 0.005)), ((-0.5, 0.6, -0.2), (0.1, 0.02, 0.3)))
    field, frames = baked(scene), 24
    _, found, frame = shown(scene, field, frames)
    expected = draw_picture(scene, field, SEEN, SIZE, shown="irradiance", samples=frames, threads=2)[..., :3]
    points, near = frame.gbuffer.position[..., :3], near_light(LightContext(scene, 2, whole=True), field)
    # The wall above the shelf, away from its edges.
    shaded = (points[..., 1] > 0.99) & (points[..., 2] > 0.5) & (np.abs(points[..., 0]) < 0.5)
    open_to_all = near.panes.irradiance(points[shaded], frame.gbuffer.normal[shaded][:, :3])
    assert shaded.sum() > 20 and open_to_all.max() > 0.2 * expected.mean()
    assert np.abs(found - expected)[shaded].max() < 0.02 * expected.mean()
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)
    assert np.abs(found - expected).mean() < 0.08 * expected.mean()


def test_probes_relit_keep_it_apart(gpu_device):
    scene = room()
    field = baked(scene)
    result, before, _ = shown(scene, field)
    lit = replace(scene, lights=(build.point_light((0.0, -0.5, 0.0), 1.0),))
    result.update(lit)
    while result.busy:
        result.take_light()
    result.frame(SEEN, SIZE)
    frame = drawn_frame(result, result.image("irradiance"), SEEN)
    near = near_light(LightContext(scene, 1, whole=True), field)
    seen, points, normals, _ = seen_at(frame)
    expected = near.left_of(field.relight(lit)).irradiance(points, normals) + near.panes.irradiance(points, normals)
    on_walls = frame.gbuffer.instance[seen] == 0
    assert np.abs(frame.irradiance[seen][:, :3] - expected)[on_walls].max() < 2e-3 * expected.max()
    assert not result.error and frame.irradiance[seen].mean() > 1.05 * before.mean()
    result.close()
