"""What varies with the angle of view: Blender's Fresnel and Layer Weight nodes, as Cycles evaluates them (`svm_node_fresnel`)."""

import numpy as np

# Cycles keeps relative indices, and the blend of facing away from 1, at least so far from 0.
_LEAST_INDEX = 1e-5
# Below this the root has no derivative that matters.
_TINY = 1e-30


def dielectric(eta, cosine) -> np.ndarray:
    """Unpolarized reflectance of a boundary with relative index ``eta`` under ``cosine`` to its normal (`fresnel_dielectric_cos`):
    1 where all is reflected."""
    eta, c = np.broadcast_arrays(np.asarray(eta, np.float64), np.abs(np.asarray(cosine, np.float64)))
    squared = eta * eta - 1.0 + c * c
    g = np.sqrt(np.maximum(squared, _TINY))
    a = (g - c) / (g + c)
    b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.where(squared > 0.0, 0.5 * a * a * (1.0 + b * b), 1.0).astype(np.float32)


def dielectric_seen(ior, cosine, back: bool) -> np.ndarray:
    """The Fresnel node."""
    eta = np.maximum(ior, _LEAST_INDEX)
    return dielectric(1.0 / eta if back else eta, cosine)


def layer_weight(blend, cosine, back: bool) -> np.ndarray:
    """The Fresnel output of the Layer Weight node."""
    eta = np.maximum(1.0 - np.asarray(blend, np.float64), _LEAST_INDEX)
    return dielectric(eta if back else 1.0 / eta, cosine)


def facing(blend, cosine) -> np.ndarray:
    """The Facing output of the Layer Weight node: 0 straight on, 1 at the rim."""
    blend = np.clip(np.asarray(blend, np.float64), 0.0, 1.0 - _LEAST_INDEX)
    exponent = np.where(blend < 0.5, 2.0 * blend, 0.5 / (1.0 - blend))
    return (1.0 - np.abs(np.asarray(cosine, np.float64)) ** exponent).astype(np.float32)
