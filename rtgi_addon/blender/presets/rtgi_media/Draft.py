"""Draft: how media are shown (ui/media.py says what for)."""

import bpy

media = bpy.context.scene.rtgi_effects.effect_media

media.tile = 16
media.slices = 32
