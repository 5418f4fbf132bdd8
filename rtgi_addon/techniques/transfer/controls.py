"""Light by sliders: the sky turned, the sun on its path by the hour, groups dimmed, as a change of the scene itself, so that what
lamps light directly follows as well."""

from dataclasses import dataclass, replace

import numpy as np

from ...scene import Scene
from .columns import group_of, is_loose_sun, materials_of
from .lighting import turned

# The tilt of the Earth's axis [rad], and days from the new year to the spring equinox.
_TILT, _EQUINOX, _YEAR = np.radians(23.44), 80.0, 365.0


@dataclass(frozen=True)
class LightControls:
    """``sky_turn`` [degrees] about +Z. ``hour`` (0 to 24, solar time; None: suns stay) on the ``day`` of the year at ``latitude``
    [degrees]; ``groups`` are factors (R, G, B) by name. ``exact_sun`` changes no light: suns are to be followed by rays."""

    sky_turn: float = 0.0
    hour: float | None = None
    latitude: float = 50.0
    day: int = 172
    groups: tuple[tuple[str, tuple[float, float, float]], ...] = ()
    exact_sun: bool = False

    @property
    def changes(self) -> bool:
        """Whether any light is other than in the file."""
        return self.sky_turn != 0.0 or self.hour is not None or any(factor != (1.0, 1.0, 1.0) for _, factor in self.groups)


def sun_towards(hour: float, latitude: float, day: int) -> np.ndarray:
    """Direction (3,) towards the sun, +Y north and +X east: the spherical triangle of pole, zenith and sun, with the declination
    of a round orbit, which is right to a degree."""
    declination = np.arcsin(np.sin(_TILT) * np.sin(2.0 * np.pi * (day - _EQUINOX) / _YEAR))
    angle, north = np.radians(15.0 * (hour - 12.0)), np.radians(latitude)
    return np.array([-np.cos(declination) * np.sin(angle),
                     np.sin(declination) * np.cos(north) - np.cos(declination) * np.cos(angle) * np.sin(north),
                     np.sin(declination) * np.sin(north) + np.cos(declination) * np.cos(angle) * np.cos(north)])


def controlled(scene: Scene, controls: LightControls) -> Scene:
    """``scene`` in the light that ``controls`` make of its own; itself where they change nothing."""
    if not controls.changes:
        return scene
    if controls.sky_turn != 0.0:
        scene = replace(scene, world=turned(scene.world, controls.sky_turn))
    factors = {name: np.array(factor) for name, factor in controls.groups if factor != (1.0, 1.0, 1.0)}
    lights = tuple(_lamp(light, controls, factors) for light in scene.lights)
    return _with_emission(replace(scene, lights=lights), factors)


def _lamp(light, controls: LightControls, factors: dict[str, np.ndarray]):
    if is_loose_sun(light):
        if controls.hour is None:
            return light
        towards = sun_towards(controls.hour, controls.latitude, controls.day)
        strength = light.strength if towards[2] > 0 else np.zeros(3)
        return _shining(replace(light, direction_world=-towards), strength)
    factor = factors.get(group_of(light))
    return light if factor is None else _shining(light, light.strength * factor)


def _shining(light, strength: np.ndarray):
    return replace(light, **{light.STRENGTH: strength.astype(np.float32)})


def _with_emission(scene: Scene, factors: dict[str, np.ndarray]) -> Scene:
    materials, instances, made = list(scene.materials), list(scene.instances), {}
    for number, instance in enumerate(instances):
        factor = factors.get(group_of(instance))
        if factor is None:
            continue
        worn = materials_of(scene, instance)
        if not any(scene.materials[index].is_emissive for index in worn.values()):
            continue
        override = dict(instance.material_override or {})
        for old, index in worn.items():
            material = scene.materials[index]
            if material.is_emissive:
                key = index, tuple(factor)
                if key not in made:
                    made[key] = len(materials)
                    materials.append(_coloured(material, factor))
                override[old] = made[key]
        instances[number] = replace(instance, material_override=override)
    return replace(scene, materials=tuple(materials), instances=tuple(instances)) if made else scene


def _coloured(material, factor: np.ndarray):
    emission = material.emission
    scaled = replace(emission, constant=np.broadcast_to(emission.constant, (3,)) * factor.astype(np.float32),
                     offset=None if emission.offset is None else emission.offset * factor.astype(np.float32))
    back, camera = (None if other is None else _coloured(other, factor) for other in (material.back, material.camera))
    return replace(material, emission=scaled, back=back, camera=camera)


