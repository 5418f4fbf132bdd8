"""The conformance case of three's ``LightProbe``: the light that arrives at a point, which no normal weighs."""

from dataclasses import replace

from ....techniques.probes.field import ProbeField
from ....techniques.probes.lookup import LookupSettings
from .. import conformance
from ..axes import Axes


def light_probe_case(field: ProbeField, axes: Axes) -> dict:
    """The kit's hardest case with the irradiance of probes that are weighed by what they see alone, as JSON-able values."""
    hard = next(case for case in conformance.cases(field, axes) if case.name == "visibility")
    kit = conformance.kit_field().with_lookup(LookupSettings(normal_weight=False, normal_bias=0.0))
    points = hard.points.astype(float) @ axes.engine_from_blender / axes.scale
    normals = (hard.normals.astype(float) @ axes.engine_from_blender).astype(hard.normals.dtype)
    return replace(hard, name="light probe", description="the same points, without a normal to weigh probes by",
                   irradiance=kit.irradiance(points, normals)).to_json()
