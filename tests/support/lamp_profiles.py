"""Profiles of lamps in closed forms, smooth enough for pictures of few pixels."""

import numpy as np

from rtgi_addon.numerics.sampling import frame
from rtgi_addon.scene import LampProfile
from rtgi_addon.scene.lamp_profile import directions, distances


def by_direction(light, reach=np.pi, of_normals=False) -> LampProfile:
    """Brighter and dimmer round the lamp's axis (or world -Z), another way in each colour."""
    axis = np.asarray(getattr(light, "direction_world", getattr(light, "normal_world", (0, 0, -1))), np.float64)
    tangent, bitangent = frame(-axis[None])
    rotation = np.concatenate([tangent, bitangent, -axis[None]]).T
    profile = LampProfile(rotation, np.zeros((64, 64, 3), np.float32), reach, of_normals)
    local = directions(profile) @ rotation
    azimuth = np.arctan2(local[..., 1], local[..., 0])[..., None] + [0.0, 1.0, 2.0]
    return LampProfile(rotation, np.float32(1.0 - 0.9 * local[..., 2:] ** 2 * np.sin(azimuth)), reach, of_normals)


def by_place() -> LampProfile:
    """Bright in one corner of an area lamp."""
    t, s = np.meshgrid(*((np.arange(count) + 0.5) / count * 2.0 - 1.0 for count in (40, 30)), indexing="ij")
    return LampProfile(by_place=np.float32(np.stack([1.0 + s * t, 1.0 + 0.9 * s, 1.0 - 0.9 * t], axis=-1)))


def linear() -> LampProfile:
    """As Light Falloff's Linear: E falls with the distance alone."""
    return LampProfile(by_distance=np.repeat(distances(1024).astype(np.float32)[:, None], 3, axis=1))
