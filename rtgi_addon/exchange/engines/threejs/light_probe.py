"""The conformance case of three's ``LightProbe``: the light that arrives at a point, which no normal weighs."""

import numpy as np

from ....techniques.lattice.field import ProbeField
from ....techniques.lattice.lookup import LookupSettings
from .. import conformance
from ..axes import Axes
from ..kit import kit_field


def light_probe_case(field: ProbeField, axes: Axes) -> dict:
    """The points of the kit's hardest case with the irradiance of probes weighed by what they see alone, as JSON-able values."""
    hard = next(case for case in conformance.cases(field, axes) if case.name == "visibility")
    points = hard.points.astype(np.float64) @ axes.engine_from_blender / axes.scale
    kit = kit_field().with_lookup(LookupSettings(normal_weight=False, normal_bias=0.0))
    return conformance.case("light probe", "the same points, without a normal to weigh probes by", conformance.KIT, kit, axes,
                            points, np.random.default_rng(4)).to_json()
