"""The rotation spectrum as docs/rotation-spectrum.md defines it, its parts under choice, and what it is compared with."""

import numpy as np

OCTAVES = 9  # Weyl's count from 1 to 512


def unit(rows):
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(length > 0, length, 1)


def part_length(bundle):
    """Square root of 12 times the largest variance of the area: of a straight uniform beam its length."""
    centred = bundle.vertices - bundle.mass @ bundle.vertices / bundle.area
    return np.sqrt(12 * np.linalg.eigvalsh((centred.T * bundle.mass) @ centred / bundle.area)[-1])


def log2(x):
    return np.log2(np.maximum(x, 1e-300))


def low_pass(bundle, span=2.0, length=None):
    """1 for waves as long as the part and longer, 0 from half as long on (`span` = 2 octaves of eigenvalue)."""
    longest = (np.pi / (length or part_length(bundle))) ** 2
    return np.clip(1 - log2(bundle.eigenvalues / longest) / span, 0, 1)


def rest_below(last, octaves):
    """Mean over each octave of a straight line in log2 from 0 at `last` to 1 at the end of all octaves."""
    edges = np.maximum(np.arange(octaves + 1) - last, 0)
    return np.diff(edges**2) / (2 * (octaves - last)) if last < octaves else np.zeros(octaves)


def kind(bundle, rho, energy, octaves=OCTAVES, first=0, reference="octaves", what="cumulative", power=1.0, rest=True):
    """Runs x octaves: mean over each octave of the cumulative share of energy, less the reference. With `rest` the energy that
    the eigenvectors do not catch lies evenly between the last of them and the end."""
    shares = (rho**2).sum(2) / np.where(energy > 0, energy, 1)[:, None]
    weyl = log2(bundle.eigenvalues[: rho.shape[1]] * bundle.area / (4 * np.pi))
    ramp = np.clip(np.arange(octaves) + first + 1 - weyl[:, None], 0, 1)
    if what == "bands":  # share of energy in each octave, the first with all below it
        ramp = np.diff(ramp, axis=1, prepend=0)
        return (shares @ ramp) ** power - ((1 / octaves) ** power if reference == "octaves" else 0)
    below = shares @ ramp
    if rest:
        below += np.maximum(1 - shares.sum(1), 0)[:, None] * rest_below(max(weyl[-1] - first, 0.0), octaves)
    level = (np.arange(octaves) + 0.5) / octaves if reference == "octaves" else {"half": 0.5, "none": 0.0}[reference]
    return (below**power - level**power) / np.sqrt(octaves)


def direction(bundle, rho, energy, span=2.0, length=None):
    """Runs x 3J: the long waves of the rotation field, with sign, over the root of the whole energy."""
    weight = low_pass(bundle, span, length)[: rho.shape[1]]
    kept = weight > 0
    values = (rho[:, kept] * weight[kept, None]).reshape(len(rho), -1)
    return values / np.sqrt(np.where(energy > 0, energy, 1))[:, None]


def spectrum(bundle, rho=None, energy=None, eigenpairs=None, weight=1.0, kinds=None, span=2.0, length=None):
    """Runs x numbers, of length 1: their products are the similarities. `weight` is that of direction against kind."""
    rho = (bundle.rho if rho is None else rho)[:, :eigenpairs]
    energy = bundle.energy if energy is None else energy
    return unit(np.hstack([kind(bundle, rho, energy, **(kinds or {})), weight * direction(bundle, rho, energy, span, length)]))


def standardised(rows):
    rows = rows - rows.mean(0)
    return rows / np.sqrt((rows**2).sum(1).mean())


def bands_of_index(bundle, rho, bands=13):
    size = rho.shape[1]
    edges = np.unique(np.round(size ** (np.arange(bands + 1) / bands)).astype(int))
    edges[-1] = size + 1
    return np.stack([np.sqrt((rho[:, a - 1 : b - 1] ** 2).sum((1, 2))) for a, b in zip(edges, edges[1:])], 1)


def centred_25(bundle, rho=None):
    """Thirteen bands of index and four triples, each block centred by the bundle's mean and scaled by its spread."""
    rho = bundle.rho if rho is None else rho
    return unit(np.hstack([standardised(bands_of_index(bundle, rho)), standardised(rho[:, :4].reshape(len(rho), -1))]))


def plain_25(bundle, rho=None):
    """The same without statistics: radians, bands weighted by one half."""
    rho = bundle.rho if rho is None else rho
    return unit(np.hstack([0.5 * bands_of_index(bundle, rho), rho[:, :4].reshape(len(rho), -1)]))


def paper_similarities(bundle):
    """Runs x runs: row q by the paper's descriptor of run q (displacement, mean + 1 standard deviation)."""
    rows = []
    for values in bundle.delta:
        size = np.abs(values)
        chosen = (size > size.mean() + size.std()).any(1)
        own, others = values[chosen].ravel(), bundle.delta[:, chosen].reshape(len(bundle.delta), -1)
        rows.append(others @ own / np.maximum(np.linalg.norm(others, axis=1) * np.linalg.norm(own), 1e-300))
    return np.array(rows)


def frames(points, triangles):
    """Orthonormal frames of faces, T x 3 x 3 with the first edge, its normal in the plane, and the face's normal as columns; the
    two edges in the plane, T x 2 x 2 as columns."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    along = unit(b - a)
    normal = unit(np.cross(b - a, c - a))
    across = np.cross(normal, along)
    zero, length = np.zeros(len(a)), np.linalg.norm(b - a, axis=1)
    edges = np.stack([length, ((c - a) * along).sum(1), zero, ((c - a) * across).sum(1)], 1).reshape(-1, 2, 2)
    return np.stack([along, across, normal], 2), edges


def face_rotations(bundle, shape):
    """T x 3 x 3 rotation, T x 3 x 3 stretch, T areas: polar decomposition of each face's deformation gradient. It maps
    plane to plane and normal to normal, so only a 2 x 2 block is left to decompose."""
    before, edges = frames(bundle.vertices, bundle.triangles)
    after, moved = frames(shape, bundle.triangles)
    (a, b), (zero, d) = (edges[:, 0, 0], edges[:, 0, 1]), (0, edges[:, 1, 1])
    inverse = np.stack([1 / a, -b / (a * d), zero * a, 1 / d], 1).reshape(-1, 2, 2)
    plane = moved @ inverse
    angle = np.arctan2(plane[:, 1, 0] - plane[:, 0, 1], plane[:, 0, 0] + plane[:, 1, 1])
    turn, gradient = np.zeros((2, len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1
    gradient[:, :2, :2], gradient[:, 2, 2] = plane, 1
    back = np.swapaxes(before, 1, 2)
    stretch = before @ np.swapaxes(turn, 1, 2) @ gradient @ back
    return after @ turn @ back, stretch, a * d / 2


def to_vertices(bundle, area, values):
    """Face values to vertices, by area: coefficients of the result are exact integrals of the face values."""
    values = values.reshape(len(values), -1)
    sums = [np.bincount(bundle.triangles.ravel(), np.repeat(v * area / 3, 3), len(bundle.mass)) for v in values.T]
    return np.stack(sums, 1) / bundle.mass[:, None]


def skew(rotation):
    return 0.5 * np.stack([rotation[:, 2, 1] - rotation[:, 1, 2], rotation[:, 0, 2] - rotation[:, 2, 0], rotation[:, 1, 0] - rotation[:, 0, 1]], 1)


def mean_rotation(rotation, area):
    """The rotation nearest to the mean by area: without it the field does not see a rigid motion, and its mean is zero."""
    left, _, right = np.linalg.svd(np.einsum("f,fij->ij", area, rotation))
    return left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right


def rotation_field(bundle, shape, keep_mean=False):
    """N x 3: sin θ × axis of the faces' rotations relative to their mean, by area."""
    rotation, _, area = face_rotations(bundle, shape)
    relative = rotation if keep_mean else mean_rotation(rotation, area).T @ rotation
    return to_vertices(bundle, area, skew(relative))


def fields(bundle, shape):
    """Functions on the vertices that could say how far each place has turned, by name."""
    rotation, stretch, area = face_rotations(bundle, shape)
    with_mean = rotation
    rotation = mean_rotation(rotation, area).T @ rotation
    sine = skew(rotation)
    # θ from both sine and cosine; the axis of a half turn is lost in the skew part, of few faces.
    angle = np.arctan2(np.linalg.norm(sine, axis=1), (np.trace(rotation, axis1=1, axis2=2) - 1) / 2)
    axis = unit(sine)
    normal = lambda points: unit(np.cross(points[bundle.triangles[:, 1]] - points[bundle.triangles[:, 0]], points[bundle.triangles[:, 2]] - points[bundle.triangles[:, 0]]))
    faces = {
        "sin θ × axis (skew part)": sine,
        "rotation vector θ × axis": axis * angle[:, None],
        "quaternion, 2 sin θ/2 × axis": axis * (2 * np.sin(angle / 2))[:, None],
        "rotation matrix − 1": rotation - np.eye(3),
        "sin θ × axis, mean rotation kept": skew(with_mean),
        "normals": normal(shape) - normal(bundle.vertices),
        "stretch U − 1": stretch - np.eye(3),
    }
    out = {name: to_vertices(bundle, area, values) for name, values in faces.items()}
    out["displacement"] = shape - bundle.vertices
    return out


def project(bundle, function):
    """K x components, and the squared norm."""
    return (bundle.eigenvectors * bundle.mass) @ function, float(((function**2).sum(1) * bundle.mass).sum())
