"""The planner: looks at a scene, measures coarse and fine lattices at a sample of receivers, and chooses the cheapest that will do.
Whatever a choice is made by comes in here; what it is measured with (references, receivers, errors) lies above in `evaluate/`.

`look` says what the scene has; `sample` draws receivers; `pilot` measures any lattice by baking only those probes that the
receivers read; `search` finds the lattice and the rays; `nesting` puts finer volumes into coarser ones; `price` predicts rays, time
and memory; `alternatives` measures the other techniques; `choice` puts it together. Nothing here depends on timings but the
predicted seconds, so that the same scene, target and seed give the same plan.
"""

from .choice import Option, Plan, Target, make_plan

__all__ = ["Option", "Plan", "Target", "make_plan"]
