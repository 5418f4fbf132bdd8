"""Tables of SH probes for include/irradiance_probes.glsl, the twin of techniques/lattice/field.py, ``ProbeField.irradiance``."""

import numpy as np

from ...numerics import sh
from ...scene.scattered import SLOTS
from ...techniques.base import Field
from ...techniques.lattice.field import ProbeField
from ...techniques.lattice.lookup import GridLookup
from ...techniques.lattice.weights import shader_constants
from ..packing import fold
from ..uniforms import UniformStruct
from .tables import Tables

# Which reconstructions blend coefficients first, as the shader numbers them; the others are linear.
_NON_LINEAR = {"geomerics": 1, "zh3": 2}


def probe_tables(field: ProbeField) -> Tables:
    """The probes of ``field`` as it reads them: deringed, dilated, with their distances."""
    lookups, settings = field.lookups, field.lookup
    # Irradiance has no odd bands above the first (A_l = 0), and a non-linear reconstruction no band above that.
    order = max(sh.order_of(lookup.coefficients.shape[1]) for lookup in lookups)
    order = min(order, 1) if settings.reconstruction in _NON_LINEAR else order - (order > 2 and order % 2)
    mode = _NON_LINEAR.get(settings.reconstruction, 0) if order else 0
    counts = [len(lookup.positions) for lookup in lookups]
    first = np.cumsum([0, *counts[:-1]])
    texels = np.cumsum([0, *(count * (lookup.tile + 1) * (lookup.tile + 2) for count, lookup in zip(counts, lookups, strict=True))])
    struct = UniformStruct("ProbeVolumes", tuple((kind, name, len(lookups)) for kind, name in (
        ("mat4", "lattice_from_offset"), ("mat4", "offset_from_lattice"), ("vec4", "centre"), ("ivec4", "resolution"),
        ("ivec4", "tile"))))
    # What the nodes of scattered volumes name; lattices have none.
    words = [np.zeros((0, SLOTS), np.float32) if lookup.volume.scattered is None else
             lookup.volume.scattered.index.reshape(-1, SLOTS).astype(np.float32) for lookup in lookups]
    first_node = np.cumsum([0, *map(len, words[:-1])])
    values = {
        "lattice_from_offset": [_lattice_from_offset(lookup) for lookup in lookups],
        "offset_from_lattice": [np.linalg.inv(_lattice_from_offset(lookup)) for lookup in lookups],
        "centre": [(*lookup.centre, lookup.bias) for lookup in lookups],
        "resolution": [(*lookup.volume.nodes, start) for lookup, start in zip(lookups, first, strict=True)],
        "tile": [(lookup.tile, start, int(len(own) > 0), node)
                 for lookup, start, own, node in zip(lookups, texels[:-1], words, first_node, strict=True)],
    }
    defines = [*shader_constants().items(), ("SH_ORDER", str(order)), ("PROBE_VOLUMES", str(len(lookups))), ("PROBES_LINEAR", "0"),
               ("PROBES_GEOMERICS", "1"), ("PROBES_ZH3", "2"), ("PROBE_RECONSTRUCTION", str(mode))]
    distances = np.zeros((1, 4), np.float32)
    if settings.normal_weight:
        defines.append(("PROBE_NORMAL_WEIGHT", "1"))
    if settings.visibility:
        defines.append(("PROBE_VISIBILITY", "1"))
        distances = np.concatenate([_distances(lookup) for lookup in lookups])
    probes = np.concatenate([_rows(lookup, order, convolved=mode == 0 and order > 2) for lookup in lookups])
    textures = {"indirect_probes": fold(probes), "indirect_distances": fold(distances)}
    if any(len(own) for own in words):
        defines.append(("PROBE_SCATTERED", "1"))
        textures["indirect_nodes"] = fold(np.concatenate(words))
    return Tables("indirect_probes", struct, values, textures, tuple(defines))


def _lattice_from_offset(lookup: GridLookup) -> np.ndarray:
    """(4, 4): lattice coordinates of points given from the volume's centre."""
    half = 0.5 * np.asarray(lookup.volume.nodes, np.float64)
    matrix = np.eye(4)
    matrix[:3, :3] = half[:, None] * np.linalg.inv(np.asarray(lookup.volume.world_from_local, np.float64)[:3, :3])
    matrix[:3, 3] = half - 0.5
    return matrix


def _rows(lookup: GridLookup, order: int, convolved: bool) -> np.ndarray:
    """(p, 4 + 12·blocks) float32: position and whether the probe is live, then whole texels of each channel's coefficients, of
    irradiance if ``convolved`` with the cosine lobe, else of radiance."""
    count, held = sh.coefficient_count(order), lookup.coefficients
    blocks = -(-count // 4)
    channels = np.zeros((len(held), 3, 4 * blocks), np.float32)
    kept = min(count, held.shape[1])
    factors = sh.cosine_coefficients(order)[:kept] if convolved else 1.0
    channels[:, :, :kept] = np.moveaxis(held[:, :kept], 1, 2) * factors
    return np.concatenate([lookup.positions, lookup.live[:, None], channels.reshape(len(held), -1)], axis=1)


def _distances(lookup: GridLookup) -> np.ndarray:
    """(texels, 4) float32: the moments of each texel of the bordered tiles and of the next one in its row."""
    width = lookup.tile + 2
    moments = lookup.moments.reshape(-1, width, width, 2)
    return np.concatenate([moments[:, :, :-1], moments[:, :, 1:]], axis=-1).reshape(-1, 4)


def grid_tables(field: Field) -> Tables:
    """Tables of any field resampled to probe grids."""
    return probe_tables(ProbeField(field.grids(), direct_lamps=field.direct_lamps))
