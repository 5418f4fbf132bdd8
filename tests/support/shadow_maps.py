"""Reflective shadow maps of test scenes, ready to be gathered from."""

from rtgi_addon.techniques.rsm.gather import prepare
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.views.reflective_shadow_map import capture
from rtgi_addon.transport.views.shadow_views import views_of


def prepared(scene, resolution=256, samples=400, threads=1, **options):
    """The light context of ``scene`` and the gather maps of all its lamps."""
    context = LightContext(scene, threads)
    maps = [capture(context, view) for lamp in range(len(scene.lights)) for view in views_of(context, lamp, resolution, **options)]
    return context, prepare(tuple(maps), samples)
