"""What transfer takes in the forms that it can be stored in, and what each loses, against the table itself."""

import numpy as np
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.progress import Progress


def forms(sun_side: int):
    """Of a block on a floor in the open."""
    scene = build.scene([build.plane("floor", 2.0), build.cube("block", 0.3)],
                        volumes=(build.volume(resolution=(2, 3, 2), half_size=0.9, center=(0, 0, 1.0)),))
    technique = techniques.get("transfer")
    field = technique.bake(scene, technique.Settings(rays=64, sun_side=sun_side, sites=0), np.random.default_rng(1), Progress())
    return field.transfer, field.stored_forms()


def test_forms_lose_what_halves_and_the_weakest_components_hold():
    transfer, (whole, halves, few) = forms(6)
    assert (whole.form, whole.error) == ("32 bits", 0.0)
    assert halves.bytes_per_probe == transfer.bytes_per_probe and few.form == "16 bits, suns by 32 vectors"
    assert whole.bytes_per_probe > halves.bytes_per_probe > few.bytes_per_probe
    table = np.concatenate([grid.suns.reshape(-1, 36) for grid in transfer.grids]).astype(np.float64)
    off = table.astype(np.float16) - table
    assert np.isclose(halves.error, np.linalg.norm(off) / np.linalg.norm(table), rtol=1e-3) and halves.error < 1e-3
    # By no 32 vectors are sums of squares nearer than by the strongest.
    strengths = np.linalg.svd(table, compute_uv=False)
    least = np.linalg.norm(strengths[32:]) / np.linalg.norm(strengths)
    assert least <= few.error * 1.001 and few.error < np.hypot(least, 2e-3)


def test_a_table_with_as_few_directions_has_no_vectors():
    assert [form.form for form in forms(3)[1]] == ["32 bits", "16 bits"]
