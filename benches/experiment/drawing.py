"""How pictures look: colours that the colour-blind can tell apart, a mark for each label, meshes drawn from an angle."""

import io
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from PIL import Image

# Okabe and Ito 2008.
COLOUR = {"crush": "#0072B2", "down": "#D55E00", "up": "#009E73", "mixed": "#8a8a8a"}
MARK = {"crush": "o", "down": "v", "up": "^", "mixed": "x"}
METHOD = {
    "descriptor": "#0072B2",
    "first M": "#D55E00",
    "PCA": "#009E73",
    "PCA, mode unseen": "#CC79A7",
    "first 500": "#8a8a8a",
    "rotation spectrum": "#000000",
}
SHADES = "RdBu_r"

plt.rcParams.update(
    {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9.5, "legend.frameon": False, "savefig.dpi": 110}
)


def save(figure, folder, name):
    """A PNG; of at most 256 colours where these do not have to pass into each other."""
    memory = io.BytesIO()
    figure.savefig(memory, format="png", bbox_inches="tight", pad_inches=0.08, facecolor="white")
    graded = any(isinstance(drawn, PolyCollection) for axes in figure.axes for drawn in axes.collections)
    plt.close(figure)
    path = os.path.join(folder, name + ".png")
    picture = Image.open(memory).convert("RGB")
    (picture if graded else picture.quantize(256, dither=Image.Dither.NONE)).save(path, optimize=True)
    return path


def rotate(points, azimuth, elevation):
    """Points as the eye sees them: to the right, up, towards the eye."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([np.cos(a), np.sin(a), 0])
    towards = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    return points @ np.stack([right, np.cross(towards, right), towards], 1)


def draw(axes, points, triangles, values, limit, azimuth=-28, elevation=22):
    """A mesh, far faces first, coloured by `values` at vertices between -limit and limit, lit from the eye."""
    seen = rotate(points, azimuth, elevation)
    corners = seen[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = np.abs(normal[:, 2]) / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    colour = plt.get_cmap(SHADES)(0.5 + values[triangles].mean(1) / (2 * limit))
    colour[:, :3] *= (0.62 + 0.38 * light)[:, None]
    order = np.argsort(corners[:, :, 2].mean(1))
    axes.add_collection(PolyCollection(corners[order, :, :2], facecolors=colour[order], edgecolors=colour[order], linewidths=0.2))
    axes.set_aspect("equal")
    axes.axis("off")


def frame(axes, points, azimuth=-28, elevation=22, margin=8):
    """The same frame for several pictures: around all `points`."""
    seen = rotate(points.reshape(-1, 3), azimuth, elevation)
    axes.set_xlim(seen[:, 0].min() - margin, seen[:, 0].max() + margin)
    axes.set_ylim(seen[:, 1].min() - margin, seen[:, 1].max() + margin)


def colour_bar(figure, axes, limit, label):
    scale = matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(-limit, limit), SHADES)
    bar = figure.colorbar(scale, ax=axes, orientation="horizontal", fraction=0.035, pad=0.03, aspect=50, shrink=0.5)
    bar.set_label(label)


def legend_of_labels(axes, **words):
    for label in COLOUR:
        axes.plot([], [], MARK[label], color=COLOUR[label], label=label, ms=5)
    axes.legend(**words)
