"""How much light comes from probes that do not see the point they light, asked of rays: on a block's face, over whose edge some
look."""

import numpy as np
import pytest
import scene_builders as build
from probe_bakes import QUICK, bake

from rtgi_addon.transport.context import LightContext

HALF, CENTRE = np.array([0.3, 0.3, 0.6]), np.array([-0.35, 0.2, -0.4])


@pytest.mark.parametrize("angle", [0.1, -0.25])
def test_probes_above_a_block_hardly_shine_over_its_edge(angle):
    """Chebyshev's bound gave them 3.4 and 4.7 % of the weight on the upper third of this face."""
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    block = build.mesh("block", (build.CUBE_CORNERS * HALF) @ turn.T + CENTRE, build.CUBE_TRIANGLES)
    scene = build.scene([build.cube("room", inward=True), block], [build.material("wall", 0.6)],
                        [build.point_light((0.1, 0.0, 0.8), 2.0)], volumes=[build.volume(resolution=(4, 4, 4), half_size=1.0)])
    lookup, = bake(scene, **QUICK).lookups
    along, up = np.meshgrid(np.linspace(-0.95, 0.95, 61), np.linspace(0.3, 0.98, 18))
    local = np.stack([along * HALF[0], np.full_like(along, -HALF[1] - 1e-4), up * HALF[2]], axis=-1).reshape(-1, 3)
    points, normals = local @ turn.T + CENTRE, np.tile(turn @ [0, -1, 0], (along.size, 1))
    index, weight = lookup.weights(points, normals)
    origins = np.repeat(points + 1e-3 * normals, 8, axis=0)
    ways = (lookup.positions[index] + lookup.centre).reshape(-1, 3) - origins
    length = np.linalg.norm(ways, axis=1)
    hidden = LightContext(scene, 1).tracer.occluded(origins.astype(np.float32), (ways / length[:, None]).astype(np.float32),
                                                    (0.999 * length).astype(np.float32))
    share = (weight * hidden.reshape(weight.shape)).sum(axis=1)
    assert hidden.any() and share.mean() < 0.02
