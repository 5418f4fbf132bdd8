"""The light that a group of volumes captures: the context its rays go by, and the lamps whose direct light it holds."""

from ...scene import ProbeVolume, Scene
from ...scene.capture import direct_light
from ...transport.context import LightContext
from ..lamp_light import LampLight
from .settings import ProbeSettings

# Samples of each lamp that has an extent, where its direct light is wanted.
LAMP_SAMPLES = 64


def capturing(context: LightContext, scene: Scene) -> LightContext:
    """The context of ``scene``, which is that of ``context`` with the light that a volume captures."""
    if scene is context.scene:
        return context
    same = scene.materials is context.scene.materials and scene.media is context.scene.media
    return LightContext(scene, context.threads, same_surfaces=context if same else None)


def lamp_light_of(context: LightContext, volume: ProbeVolume, settings: ProbeSettings, seed: int) -> LampLight:
    """The direct light of lamps that ``volume`` holds."""
    return LampLight(capturing(context, direct_light(context.scene, volume)), settings.direct, LAMP_SAMPLES, seed)
