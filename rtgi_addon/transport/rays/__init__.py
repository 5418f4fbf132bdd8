"""Rays against triangles: what tracers share (`tracer`), one module a tracer, alpha over any of them, and the choice.

`make_tracer` in `choose` is the only place that knows them all; a new tracer comes in as a module and a line there.
"""
