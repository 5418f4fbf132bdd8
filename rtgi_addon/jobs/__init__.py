"""What the three doors share (rank 6): from a Scene to a finished bundle, chart, plan, export.

A job takes a ``Scene`` and settings, reports progress, and writes files; a new command or button comes in as a job here first.
"""
