"""Rays and views of lamps as they are with their profile: what light transport asks instead of a lamp's kind."""

import numpy as np

from ...scene import AreaLight, Light
from .area import lamp_places
from .beam import Beam
from .kind import Emission
from .kinds import kind_of
from .profile import profile_of
from .shadow_view import ShadowView


def emit(light: Light, u: np.ndarray, beam: Beam) -> tuple[Emission, np.ndarray]:
    """Rays of ``light`` for ``u`` (n, 4) in [0, 1), as LampKind.emit, and the numbers (n, 4) that its kind has them from."""
    profile = profile_of(light)
    if profile is None:
        return kind_of(light).emit(light, u, beam), u
    u, gain = profile.warp_emitting(u)
    emission = kind_of(light).emit(light, u, beam)
    factor = profile.factor(emission.origins, emission.directions)
    return emission._replace(power=emission.power * factor * gain[:, None]), u


def connect(light: Light, points: np.ndarray, u: np.ndarray, beam: Beam) -> tuple:
    """As LampKind.connect: the lamp shines where its profile lets it."""
    origins, directions, domain, shines = kind_of(light).connect(light, points, u, beam)
    profile = profile_of(light)
    if profile is not None:
        shines = shines & np.any(profile.factor(origins, directions) > 0, axis=1)
    return origins, directions, domain, shines


def arriving_share(light: Light, points: np.ndarray, u: np.ndarray, beam: Beam) -> np.ndarray:
    """What (n, 1) or (n, 3) arrives at ``points`` (n, 3) of what ``emit`` sends there by the numbers ``u`` (n, 2) of its places."""
    share = kind_of(light).near_gain(light, points)[:, None]
    profile = profile_of(light)
    if profile is None or light.profile.by_distance is None:
        return share
    away = points - kind_of(light).connect(light, points, u, beam)[0]
    if isinstance(light, AreaLight) and light.spread <= 0:
        # A parallel beam leaves the lamp right above.
        normal = np.asarray(light.normal_world, np.float32)
        away = away * normal
        away[:] = np.abs(away.sum(axis=1, keepdims=True)) * normal
    return share * profile.of_distance(np.sqrt((away * away).sum(axis=1)))


def view_share(light: Light, view: ShadowView) -> np.ndarray | None:
    """The profile's factor (n, 3) on what goes through each texel of ``view``; None without one. Distances are not in it."""
    profile = profile_of(light)
    if profile is None:
        return None
    share = profile.to_far(view.directions().astype(np.float32))
    if light.profile.by_place is None:
        return share
    if view.orthographic:
        # A parallel beam: each texel leaves the lamp where it lies.
        return share * profile.of_place(view.rays()[0])
    places, own = lamp_places(light, view)
    return share * profile.share(places, own)


def distance_share(light: Light, distance: np.ndarray) -> np.ndarray | None:
    """The profile's factor (n, 3) at ``distance`` (n,) [m] from the lamp; None where that changes nothing."""
    if light.profile is None or light.profile.by_distance is None:
        return None
    return profile_of(light).of_distance(distance)
