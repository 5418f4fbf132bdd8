"""Media on the GPU, for every program that includes include/media.glsl."""

from ..scene import Medium
from .media_tables import media_texels
from .textures import upload


class MediaTextures:
    """The media of one scene after another on the GPU: ``samplers`` for include/media.glsl, and their ``count``."""

    def __init__(self):
        self._media: tuple[Medium, ...] | None = None

    def of(self, media: tuple[Medium, ...]) -> "MediaTextures":
        """Those of ``media``; sent anew if they are not the very same as before."""
        before = self._media
        if before is None or len(before) != len(media) or any(a is not b for a, b in zip(before, media, strict=True)):
            texels = media_texels(media)
            self._media, self.count = media, texels.count
            self.samplers = {"media_table": upload(texels.table, name="the table of media"),
                             "media_cells": upload(texels.cells, name="the cells of media")}
        return self
