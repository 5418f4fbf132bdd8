"""How right and how fast a field is (rank 5): references, metrics, charts, leaks, the failure suite, the planner.

What measures or draws a ``Field`` without knowing who baked it comes in here. matplotlib is imported inside functions.
"""
