"""GGX over Lambert in numpy, straight from the formulas: the twin of include/brdf.glsl."""

import numpy as np


def ggx_energy(cosine, roughness, f0, f90, samples=100_000):
    """(3,) share of the light from direction ``cosine`` that a GGX layer reflects, by summing over a grid of half vectors."""
    alpha = max(roughness**2, 2e-3)
    side = int(np.sqrt(samples))
    u, phi = np.meshgrid((np.arange(side) + 0.5) / side, (np.arange(side) + 0.5) / side * 2 * np.pi)
    # Half vectors in proportion to D·cos.
    z = np.sqrt((1 - u) / (1 + (alpha**2 - 1) * u))
    ring = np.sqrt(1 - z * z)
    half = np.stack([ring * np.cos(phi), ring * np.sin(phi), z], -1)
    view = np.array([np.sqrt(1 - cosine**2), 0, cosine])
    vh = half @ view
    light_z = 2 * vh * z - cosine
    seen = (light_z > 0) & (vh > 0)
    safe = np.where(seen, light_z, 1.0)
    masking = 2 * safe * cosine / (safe * np.sqrt(cosine**2 * (1 - alpha**2) + alpha**2)
                                   + cosine * np.sqrt(safe**2 * (1 - alpha**2) + alpha**2))
    weight = np.where(seen, masking * np.abs(vh) / (z * cosine), 0.0)
    grazing = np.clip(1 - vh, 0, 1) ** 5
    return np.array([np.mean(weight * (a + (b - a) * grazing)) for a, b in zip(f0, f90, strict=True)])


def sky_energy(roughness, f0, f90):
    """(3,) the mean of ``ggx_energy`` over a uniform sky."""
    cosines = (np.arange(32) + 0.5) / 32
    return np.mean([2 * c * ggx_energy(c, roughness, f0, f90, 4096) for c in cosines], axis=0)


def _gain(f0, f90, energy):
    return 1 + (f0 + (f90 - f0) / 21) * (1 - energy) / energy


def reflectance(albedo, base_color, metallic, roughness, specular, normal, view, light):
    """Radiance per irradiance (3,) [1/sr] for unit vectors, the light and the eye above the surface."""
    f0 = specular * (1 - metallic) + np.asarray(base_color) * metallic
    f90 = np.clip(100 * f0, 0, 1)
    ones = np.ones(3)
    cosine = float(normal @ view)
    layer = ggx_energy(cosine, roughness, f0, f90) * _gain(f0, f90, ggx_energy(cosine, roughness, ones, ones))
    mean = sky_energy(roughness, f0, f90) * _gain(f0, f90, sky_energy(roughness, ones, ones))
    diffuse = np.maximum(albedo - mean, 0) * (1 - layer.max()) / (1 - mean.max())
    half = (view + light) / np.linalg.norm(view + light)
    alpha2 = max(roughness**2, 2e-3) ** 2
    nv, nl, nh, vh = normal @ view, normal @ light, normal @ half, view @ half
    distribution = alpha2 / (np.pi * (nh**2 * (alpha2 - 1) + 1) ** 2)
    masking = 0.5 / (nl * np.sqrt(nv**2 * (1 - alpha2) + alpha2) + nv * np.sqrt(nl**2 * (1 - alpha2) + alpha2))
    gain = _gain(f0, f90, ggx_energy(cosine, roughness, ones, ones))
    return diffuse / np.pi + (f0 + (f90 - f0) * (1 - vh) ** 5) * gain * distribution * masking
