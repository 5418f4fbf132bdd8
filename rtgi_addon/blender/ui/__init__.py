"""What a user meets in Blender: panels, operators, properties, presets, one module a tool. A new tool comes in as a module with
``register`` and ``unregister`` and a line in `blender/registration.py`.

A module here draws, asks and starts jobs; what a job does lives in `jobs/`, so that the command line has it too.
"""
