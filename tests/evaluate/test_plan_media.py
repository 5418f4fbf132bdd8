"""What a plan says of media: whether they matter, by closed forms, and how fine probes would follow them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scene_builders import cube, open_plane, transform

from rtgi_addon.evaluate.plan.look import Motion, look_at, sentences
from rtgi_addon.evaluate.plan.media import look_at_media
from rtgi_addon.evaluate.plan.sample import draw_sample
from rtgi_addon.exchange.plain import plain
from rtgi_addon.scene import ClosedMesh, Medium
from rtgi_addon.transport.context import LightContext


def looked(*media, **plane):
    """The look at a bare plane under a white sky with ``media``."""
    scene = open_plane(albedo=0.0, half_size=20.0, resolution=(4, 4, 2), center=(0, 0, 0.6), **plane)
    context = LightContext(replace(scene, media=media), 1)
    sample = draw_sample(context, scene.volumes, 32, 0)
    return look_at(context, scene.volumes, sample, Motion())


def slab(**what):
    """A medium between the plane and the sky, one metre thick, above the probes."""
    bounds = ClosedMesh(cube().vertices_local, cube().triangles, transform((0, 0, 3), (5000, 5000, 0.5)))
    return Medium("slab", bounds=bounds, **what)


def test_without_media_nothing_is_looked_at():
    found = looked()
    assert found.media is None and "edia" not in " ".join(sentences(found))


def test_an_absorbing_slab_takes_what_two_exponential_integrals_say():
    """E/E₀ = 2·E₃(τ): 0.21939 at τ = 1."""
    found = looked(slab(absorption=np.ones(3))).media
    assert found.change == pytest.approx(0.21939 - 1.0, abs=max(3 * found.error, 0.01)) and found.matters
    assert found.free_path is None and found.fine is None and found.names == ("slab",)
    # Half of what probes see is the plane below them.
    assert found.taken == pytest.approx(0.5 * (1 - 0.148), abs=0.12)


def test_a_haze_that_hardly_matters_is_said_to():
    found = looked(slab(absorption=np.full(3, 1e-4)))
    assert not found.media.matters and any("hardly matter" in line for line in sentences(found))


def test_what_scatters_asks_for_cells_no_wider_than_its_mean_free_path():
    found = looked(slab(scattering=np.full(3, 4.0)))
    assert found.media.free_path == pytest.approx(0.25) and found.media.densest == "slab"
    (resolution,) = found.media.fine
    assert all(side / count <= 0.25 + 1e-6 for side, count in zip((1.0, 1.0, 1.0), resolution, strict=True))
    assert any("mean free path, 0.25 m" in line for line in sentences(found)) == (found.media.spacing > 0.25)
    json.dumps(plain(found.media.__dict__))


def test_the_same_seed_says_the_same():
    scene = replace(open_plane(albedo=0.0, half_size=20.0), media=(slab(absorption=np.ones(3)),))
    context = LightContext(scene, 1)
    sample = draw_sample(context, scene.volumes, 16, 0)
    assert look_at_media(context, scene.volumes, sample, 3) == look_at_media(context, scene.volumes, sample, 3)
