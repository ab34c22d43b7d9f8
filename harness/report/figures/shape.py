"""A reconstructed surface: from several sides, painted by how well it is known, and cut beside the truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.basics.mesh import Mesh
from harness.report.figures.style import ANSWER, HEAT, INK, SOFT, TOOL, TRUTH, blank, styled

_SIDES = (("from the front", -90.0, 15.0), ("from the left", 180.0, 15.0), ("from above", -90.0, 89.9))
_SIDES_BELOW = (("from the back", 90.0, 15.0), ("from the right", 0.0, 15.0), ("aslant", -55.0, 35.0))
_LAMP = np.array([-0.4, 0.5, 0.8]) / np.linalg.norm([-0.4, 0.5, 0.8])
_AMBIENT = 0.45
_AROUND = 0.35
_LEAST_SPREAD = 1e-4

_TURN, _HEIGHT = -55.0, 35.0
_ACROSS = 4
"""Pictures in a row."""

_WIDTH, _TALL = 2.1, 2.2
_MARGIN = 0.04


@dataclass(frozen=True, eq=False)
class KnownSurface:
    """A surface, how well it is known, and what is known of it; m, z up."""

    mesh: Mesh  #: the surface.
    deviation: FloatArray  #: ``(vertices,)`` m, one standard deviation along the normal.
    contacts: FloatArray  #: ``(n, 3)`` m, the middle of each contact.
    passed: Sequence[FloatArray]  #: ``(2, 3)`` m each: ways of the gel that met nothing, from and to.


def surface_figure(shown: KnownSurface) -> Figure:
    """The surface from six sides, its colour the deviation, with contacts and ways that met nothing."""
    scale = scale_of(shown.deviation)
    with styled():
        figure = blank(8.4, 6.0, "constrained")
        axes = figure.subplots(2, 3)
        for one, (title, turn, height) in zip(axes.flat, (*_SIDES, *_SIDES_BELOW), strict=True):
            painted = paint_surface(one, shown, seen_from(turn, height), scale)
            one.set_title(title, fontsize=9, loc="left")
        bar = figure.colorbar(painted, ax=axes, shrink=0.6, extend="max")
        bar.set_label("standard deviation in mm")
    return figure


def scale_of(deviation: FloatArray) -> Normalize:
    """Of colours for deviations in mm, from nothing to almost the greatest of ``(n,)`` m."""
    return Normalize(0.0, 1e3 * max(float(np.quantile(deviation, 0.98)), _LEAST_SPREAD))


def seen_from(turn: float, height: float) -> FloatArray:
    """``(3, 3)`` rows: right, up and towards the viewer, who stands at these degrees about z and above."""
    a, h = np.radians(turn), np.radians(height)
    towards = np.array([np.cos(a) * np.cos(h), np.sin(a) * np.cos(h), np.sin(h)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.array([right, np.cross(towards, right), towards])


def paint_surface(axes: Axes, shown: KnownSurface, view: FloatArray, scale: Normalize) -> PolyCollection:
    """Draw a surface with its contacts and ways, in cm; what was painted, for a bar of its colours.

    Args:
        axes: to draw in; they lose their frame.
        shown: the surface.
        view: as ``seen_from`` gives it.
        scale: of deviations in mm.
    """
    mesh = shown.mesh
    facing = mesh.face_normals @ view[2]
    seen = np.flatnonzero(facing > 0.0)
    corners = mesh.corners[seen] @ view.T
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    deviation = 1e3 * shown.deviation[mesh.faces[seen]].mean(axis=1)
    light = _AMBIENT + (1.0 - _AMBIENT) * np.abs(mesh.face_normals[seen] @ (_LAMP @ view))
    colours = HEAT(scale(deviation))
    colours[:, :3] *= light[:, None]
    # In one array: of a list a path would be made face by face.
    polygons = cast("Sequence[FloatArray]", 1e2 * corners[order, :, :2])
    painted = PolyCollection(
        polygons,
        facecolors=colours[order],
        edgecolors=colours[order],
        linewidths=0.3,
    )
    axes.add_collection(painted)
    for way in shown.passed:
        ends = 1e2 * way @ view[:2].T
        axes.plot(ends[:, 0], ends[:, 1], color=SOFT, lw=0.8, ls=":")
    places = 1e2 * shown.contacts.reshape(-1, 3) @ view[:2].T
    axes.plot(places[:, 0], places[:, 1], "o", ms=3, mfc="white", mec=INK, mew=0.7)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set_axis_off()
    painted.set_cmap(HEAT)
    painted.set_norm(scale)
    return painted


def sections_figure(answer: Mesh, truth: Mesh | None) -> Figure:
    """Both surfaces cut by the two upright planes and the level one through the answer's middle."""
    import trimesh  # here, because importing it takes a third of a second

    middle = answer.bounds.mean(axis=0)
    cuts = (("upright, along x", 1, (0, 2)), ("upright, along y", 0, (1, 2)), ("level", 2, (0, 1)))
    with styled():
        figure = blank(8.4, 3.2, "constrained")
        for axes, (title, normal, shown) in zip(figure.subplots(1, 3), cuts, strict=True):
            for mesh, colour, label in ((truth, TRUTH, "true (mock)"), (answer, ANSWER, "estimate")):
                if mesh is not None:
                    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
                    across = np.eye(3)[normal]
                    cut = body.section(plane_normal=across, plane_origin=float(middle[normal]) * across)
                    lines = [
                        1e2 * np.asarray(line)[:, shown] for line in ([] if cut is None else cut.discrete)
                    ]
                    axes.add_collection(LineCollection(lines, colors=colour, linewidths=1.3, label=label))
            axes.autoscale_view()
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_title(title, fontsize=9, loc="left")
            axes.set_xlabel("cm")
        axes.legend(loc="upper right", frameon=False, fontsize=8)
    return figure


def mask_figure(picture: ByteArray, mask: BoolArray) -> Figure:
    """The border of what was taken for the object, on the picture about it."""
    rows, columns = np.nonzero(mask)
    margin = _AROUND * max(int(np.ptp(rows)), int(np.ptp(columns)))
    with styled():
        figure = blank(6.4, 4.8, "constrained")
        axes = figure.add_subplot()
        axes.imshow(picture, interpolation="nearest")
        axes.contour(mask, levels=[0.5], colors=TOOL, linewidths=1.6)
        axes.set_xlim(max(0.0, columns.min() - margin), min(picture.shape[1], columns.max() + margin))
        axes.set_ylim(min(picture.shape[0], rows.max() + margin), max(0.0, rows.min() - margin))
        axes.set_xticks([])
        axes.set_yticks([])
    return figure


@dataclass(frozen=True, eq=False)
class SurfaceThen:
    """A surface as it was known at some time of a run."""

    title: str  #: when.
    words: str  #: how well it was known, or why it was not.
    shown: KnownSurface | None  #: None where there was none.


def strip_figure(found: Sequence[SurfaceThen]) -> Figure:
    """Surfaces one after the other, from one side, at one size and in one scale of colours.

    Args:
        found: one or more, of which one at least has a surface.
    """
    surfaces = [one.shown for one in found if one.shown is not None]
    scale = scale_of(np.concatenate([one.deviation for one in surfaces]))
    view = seen_from(_TURN, _HEIGHT)
    places = [1e2 * one.mesh.vertices @ view[:2].T for one in surfaces]
    low = np.min([one.min(axis=0) for one in places], axis=0)
    high = np.max([one.max(axis=0) for one in places], axis=0)
    low, high = low - _MARGIN * (high - low), high + _MARGIN * (high - low)
    rows = -(-len(found) // _ACROSS)
    with styled():
        figure = blank(_ACROSS * _WIDTH, rows * _TALL, "constrained")
        axes = np.asarray(figure.subplots(rows, _ACROSS)).ravel().tolist()
        for one, then in zip(axes, found, strict=False):
            one.set_title(f"{then.title}\n", fontsize=9, loc="left")
            one.text(0.0, 1.02, then.words, transform=one.transAxes, fontsize=8, color=SOFT)
            if then.shown is None:
                one.set_axis_off()
            else:
                paint_surface(one, then.shown, view, scale)
            one.set_aspect("equal", adjustable="box")
            one.set_xlim(low[0], high[0])
            one.set_ylim(low[1], high[1])
        for one in axes[len(found) :]:
            one.set_axis_off()
    return figure
