"""The planner: looks at a scene, measures coarse and fine lattices at a sample of receivers, and chooses the cheapest that will do.

`look` says what the scene has; `sample` draws receivers; `pilot` measures any lattice by baking only those probes that the
receivers read; `search` finds the lattice and the rays; `unseen` tells which probes no surface reads; `price` predicts rays, time
and memory; `alternatives` measures the other techniques; `choice` puts it together. Nothing here depends on timings but the
predicted seconds, so that the same scene, target and seed give the same plan.
"""

from .choice import Option, Plan, Target, make_plan

__all__ = ["Option", "Plan", "Target", "make_plan"]
