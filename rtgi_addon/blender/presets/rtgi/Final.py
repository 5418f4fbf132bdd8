"""Final: for shipping; the values are the techniques' own."""

import bpy

bpy.context.scene.rtgi.use_preset("final")
