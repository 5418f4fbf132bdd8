"""The sample scenes, by name: each function fills the empty file that ``kit.reset`` leaves and returns nothing."""

from .adversarial import adversarial
from .atrium import atrium
from .glossy import metal_shop, wet_floor
from .halls import many_lights
from .media import fog_hall, media_box, smoke
from .outdoors import outdoor_hdri, sky_courtyard, sun_window
from .rooms import cornell_box, corridor_door_ajar, furnace, integrating_sphere, two_rooms
from .shop import evening_shop
from .street import toon_street

SAMPLES = {function.__name__: function for function in (
    cornell_box, furnace, integrating_sphere, two_rooms, corridor_door_ajar, sky_courtyard, sun_window, atrium, many_lights,
    outdoor_hdri, adversarial, media_box, fog_hall, smoke, wet_floor, metal_shop, toon_street, evening_shop,
)}
