"""What an irradiance function reads, as arrays; knows no GPU, so that every host of the shaders can have it."""

from dataclasses import dataclass

import numpy as np

from ..program import Program
from ..programs import indirect_program
from ..uniforms import UniformStruct

# The name of the functions' uniform buffer in the shaders.
UNIFORMS = "indirect"


@dataclass(frozen=True, eq=False)
class Tables:
    """Everything that ``shaders/NAME.comp.glsl``, with the irradiance function of one technique in it, needs of one field.

    ``struct`` with its ``values`` is the uniform buffer ``indirect``; ``textures`` are arrays (h, w, 4) float32 by sampler name;
    ``defines`` are (name, value).
    """

    name: str
    struct: UniformStruct
    values: dict
    textures: dict[str, np.ndarray]
    defines: tuple[tuple[str, str], ...] = ()

    @property
    def program(self) -> Program:
        """The program that fills an image of irradiance."""
        return indirect_program(self.name, ((UNIFORMS, self.struct),), tuple(self.textures), self.defines)


# No light.
DARK = Tables("indirect_dark", UniformStruct("NoLight", (("float", "radiance"),)), {"radiance": 0.0}, {})
