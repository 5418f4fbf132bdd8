"""GGX over Lambert in numpy, straight from the formulas: the twin of include/brdf.glsl."""

import numpy as np


def schlick(f0, f90):
    """Fresnel terms of Schlick's curve from ``f0`` to ``f90`` (3,)."""
    return lambda cosine: np.asarray(f0)[:, None] + (np.asarray(f90) - f0)[:, None] * np.clip(1 - cosine, 0, 1) ** 5


def dielectric(f0):
    """Fresnel's equations for a boundary that reflects ``f0`` of what comes straight on."""
    index = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))

    def fresnel(cosine):
        refracted = np.sqrt(1 - (1 - np.clip(cosine, 0, 1) ** 2) / index**2)
        across = (cosine - index * refracted) / np.maximum(cosine + index * refracted, 1e-9)
        along = (index * cosine - refracted) / np.maximum(index * cosine + refracted, 1e-9)
        return np.tile(0.5 * (across**2 + along**2), (3, 1))
    return fresnel


def layer_energy(cosine, roughness, fresnel, samples=100_000):
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
    return (weight.ravel() * fresnel(np.clip(vh, 0, 1).ravel())).mean(axis=1)


def ggx_energy(cosine, roughness, f0, f90, samples=100_000):
    """(3,) as ``layer_energy`` with Schlick's curve."""
    return layer_energy(cosine, roughness, schlick(f0, f90), samples)


def _over_the_sky(roughness, fresnel):
    cosines = (np.arange(24) + 0.5) / 24
    return np.mean([2 * c * layer_energy(c, roughness, fresnel, 1600) for c in cosines], axis=0)


def _layers(base_color, metallic, roughness, specular, cosine):
    """Of metal and dielectric: share of the layer, Fresnel term, and by what multiple scattering adds to it, at ``cosine`` and in
    the mean."""
    white = schlick(np.ones(3), np.ones(3))
    energy, mean = layer_energy(cosine, roughness, white, 10_000), _over_the_sky(roughness, white)
    color = np.asarray(base_color, float)
    for share, fresnel in ((metallic, schlick(color, np.clip(100 * color, 0, 1))), (1 - metallic, dielectric(specular))):
        cosines = (np.arange(256) + 0.5) / 256
        of_once = (2 * cosines * fresnel(cosines)).mean(axis=1)
        again = of_once * mean / (1 - of_once * (1 - mean))
        yield share, fresnel, 1 + again * (1 - energy) / energy, 1 + again * (1 - mean) / mean


def reflectance(albedo, base_color, metallic, roughness, specular, normal, view, light):
    """Radiance per irradiance (3,) [1/sr] for unit vectors, the light and the eye above the surface."""
    cosine = float(normal @ view)
    half = (view + light) / np.linalg.norm(view + light)
    alpha2 = max(roughness**2, 2e-3) ** 2
    nv, nl, nh, vh = normal @ view, normal @ light, normal @ half, np.array([view @ half])
    distribution = alpha2 / (np.pi * (nh**2 * (alpha2 - 1) + 1) ** 2)
    masking = 0.5 / (nl * np.sqrt(nv**2 * (1 - alpha2) + alpha2) + nv * np.sqrt(nl**2 * (1 - alpha2) + alpha2))
    layer, mean = np.zeros(3), np.zeros(3)
    for share, fresnel, more, more_mean in _layers(base_color, metallic, roughness, specular, cosine):
        of_sky = _over_the_sky(roughness, fresnel) * more_mean
        layer, mean = layer + share * fresnel(vh)[:, 0] * more * distribution * masking, mean + share * of_sky
    # The last is the dielectric, which lets the rest of the light through to what is diffuse.
    below, below_mean = 1 - (layer_energy(cosine, roughness, fresnel, 10_000) * more).max(), 1 - of_sky.max()
    return np.maximum(albedo - mean, 0) * below / below_mean / np.pi + layer
