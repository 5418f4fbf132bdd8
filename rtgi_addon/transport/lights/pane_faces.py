"""Triangles put together to the flat faces that they were cut from, two by two: half as many pieces to light from."""

import numpy as np

# Corners off a plane by no more than this share of the face's size lie in it.
_FLAT = 1e-4


def flat_faces(triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Quadrilaterals (m, 4, 3) float64 that ``triangles`` (t, 3, 3) make, flat and convex; one without a partner has its last
    corner twice. They run counter-clockwise about unit ``normals`` (t, 3)."""
    triangles = np.array(triangles, np.float64)
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    turned = np.einsum("ij,ij->i", across, normals) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    faces, free = [], list(range(len(triangles)))
    while free:
        first = free.pop(0)
        for second in free:
            quad = _joined(triangles[first], triangles[second], normals[first], normals[second])
            if quad is not None:
                free.remove(second)
                faces.append(quad)
                break
        else:
            faces.append(triangles[first][[0, 1, 2, 2]])
    return np.array(faces).reshape(-1, 4, 3)


def _joined(one: np.ndarray, other: np.ndarray, normal: np.ndarray, other_normal: np.ndarray) -> np.ndarray | None:
    """The quadrilateral (4, 3) of two triangles (3, 3) that share an edge, None where it is not flat and convex."""
    if normal @ other_normal < 1.0 - _FLAT:
        return None
    shared = [[i, j] for i in range(3) for j in range(3) if np.array_equal(one[i], other[j])]
    if len(shared) != 2:
        return None
    apex = ({0, 1, 2} - {i for i, _ in shared}).pop()
    far = other[({0, 1, 2} - {j for _, j in shared}).pop()]
    quad = np.array([one[apex], one[(apex + 1) % 3], far, one[(apex + 2) % 3]])
    size = np.abs(quad - quad[0]).max()
    if abs((far - quad[0]) @ normal) > _FLAT * size:
        return None
    edges = np.roll(quad, -1, axis=0) - quad
    corners = np.cross(edges, np.roll(edges, -1, axis=0)) @ normal
    return quad if np.all(corners > 0) else None
