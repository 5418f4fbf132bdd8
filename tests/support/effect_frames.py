"""What a renderer has drawn, brought back from the GPU as a numpy effect is given it."""

from rtgi_addon.effects import Frame
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.gbuffer import GBuffer


def drawn_frame(result, light, view, transparent=False):
    """The latest sample of ``result`` (a PreviewRenderer) as a Frame whose light so far is ``light`` (h, w, 4)."""
    from rtgi_addon.preview.textures import download
    gbuffer = GBuffer(**{name: download(texture) for name, texture in result.gbuffer.items()})
    context = LightContext(result.scene, 1)
    return Frame(result.scene, view, gbuffer, download(result._direct), download(result._irradiance), light,
                 transparent=transparent, open_context=lambda: context)
