"""What fills space and absorbs, scatters or emits light between surfaces: fog, smoke, fire.

Where media overlap, their coefficients add up, as in Cycles. A shader that scatters by several phase functions is as many media
with the same bounds.
"""

from dataclasses import dataclass, field

import numpy as np

# The phase functions there are (``Phase.kind``), by Blender's own names.
HENYEY_GREENSTEIN, RAYLEIGH, DRAINE = "HENYEY_GREENSTEIN", "RAYLEIGH", "DRAINE"
FOURNIER_FORAND, MIE = "FOURNIER_FORAND", "MIE"
PHASE_KINDS = (HENYEY_GREENSTEIN, RAYLEIGH, DRAINE, FOURNIER_FORAND, MIE)


@dataclass(frozen=True)
class Phase:
    """How a medium distributes what it scatters over directions, with Blender's own parameters; each kind (one of
    ``PHASE_KINDS``) reads its own and leaves the others alone. transport/media/phase.py evaluates and samples them.

    ``anisotropy`` g in (−1, 1): HENYEY_GREENSTEIN (0: isotropic) and DRAINE, which has ``alpha`` from 0 (Henyey-Greenstein) as
    well; ``ior`` of the particles and ``backscatter``, the share in (0, 0.5) of light that is thrown back: FOURNIER_FORAND;
    ``diameter`` of water droplets [µm]: MIE. RAYLEIGH has none.
    """

    kind: str = HENYEY_GREENSTEIN
    anisotropy: float = 0.0
    alpha: float = 0.5
    ior: float = 1.33
    backscatter: float = 0.1
    diameter: float = 20.0


@dataclass(frozen=True, eq=False)
class ClosedMesh:
    """The inside of a closed surface: ``vertices_local`` (v, 3) float32 and ``triangles`` (t, 3) int32 under ``world_from_local``
    (4, 4) float64, any affine map.

    A point is inside where the surface winds about it at least once, either way round: parts that overlap fill space once, and it
    does not matter which way the faces point.
    """

    vertices_local: np.ndarray
    triangles: np.ndarray
    world_from_local: np.ndarray


@dataclass(frozen=True, eq=False)
class DensityGrid:
    """Factors of a medium's coefficients over a box, the layout of numerics/grid.py: cell-centred samples of the box local [−1, 1]³
    under ``world_from_local`` (4, 4) float64, arrays indexed [z, y, x].

    ``density`` (nz, ny, nx) float32 multiplies absorption and scattering; ``scattering``, ``absorption`` and ``emission``
    (nz, ny, nx, 3) float32, or None for 1 everywhere, the coefficient of that name. Emission is not multiplied by density. All are
    finite and from 0. Each is interpolated trilinearly by itself, beyond the outermost samples it keeps their values up to the
    box's faces; outside the box there is no medium.
    """

    world_from_local: np.ndarray
    density: np.ndarray
    scattering: np.ndarray | None = None
    absorption: np.ndarray | None = None
    emission: np.ndarray | None = None

    @property
    def resolution(self) -> tuple[int, int, int]:
        """Number of samples along x, y and z."""
        nz, ny, nx = self.density.shape
        return nx, ny, nz


@dataclass(frozen=True, eq=False)
class Medium:
    """One medium. ``name`` is that of the object it fills, or of the world.

    ``scattering`` σ_s, ``absorption`` σ_a [1/m] and ``emission`` ε [W·sr⁻¹·m⁻³: radiance a metre] (3,) float64, from 0, are its
    coefficients; where there is a ``grid``, what its arrays multiply. ``bounds`` is where it is: everywhere (None: a world's
    medium) or within a closed mesh; with a ``grid``, only where that is as well. ``visible_camera``, ``visible_diffuse`` and
    ``visible_shadow`` are the object's ray visibility and ``bake`` says whether bakes know it, as in ``Instance``.
    """

    name: str
    scattering: np.ndarray = field(default_factory=lambda: np.zeros(3))
    absorption: np.ndarray = field(default_factory=lambda: np.zeros(3))
    emission: np.ndarray = field(default_factory=lambda: np.zeros(3))
    phase: Phase = Phase()
    bounds: ClosedMesh | None = None
    grid: DensityGrid | None = None
    visible_camera: bool = True
    visible_diffuse: bool = True
    visible_shadow: bool = True
    bake: str = "STATIC"

    @property
    def extinction(self) -> np.ndarray:
        """σ_t = σ_s + σ_a (3,) float64 [1/m]; with a grid, to be multiplied by density (and by what else it has)."""
        return np.asarray(self.scattering, np.float64) + np.asarray(self.absorption, np.float64)

    @property
    def fills_space(self) -> bool:
        """Whether it is everywhere, evenly: a world's fog."""
        return self.bounds is None and self.grid is None

    @property
    def is_emissive(self) -> bool:
        """Whether it gives light of its own anywhere."""
        return bool(np.any(np.asarray(self.emission) > 0)) and (
            self.grid is None or self.grid.emission is None or bool(np.any(self.grid.emission > 0)))
