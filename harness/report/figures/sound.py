"""Pictures of sound: a strike and its modes, a recording next to the model's, and each sense's posterior."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh
from harness.experiment.report_content import Missing
from harness.objectfile.surface_search import SurfaceSearch
from harness.report.figures.pictures import Heat, Posterior, mark, object_sides
from harness.report.figures.shading import Paint, Shot
from harness.report.figures.style import ANSWER, INK, SOFT, TOOL, TRUTH, blank, styled

FLOOR = -70.0
"""dB against a spectrogram's own loudest, below which nothing is told apart."""

_SPREAD = 30.0
_MARK = 70.0
_SENSE_WIDTH = 3.1
_TITLES = 0.5

SHOWN = 8
"""Modes at most, the lowest, whose shapes are drawn."""

MODE_FLOOR = -90.0
"""dB against the loudest, below which a spectrogram is dark."""

_COLUMNS = 4
_TILE = 2.55
_PIXELS = 340
_SOUND = 3.1
_TITLE = 0.42
_CAPTION = 0.40
_FOOT = 0.34
_MARGIN = 0.06
_WINDOW = 0.023
_FRAMES = 500
_LIFT = 3e-3
_DULL = 0.92
_FINE = 0.04
_MOST_FACES = 200_000
_SHAPES = colormaps["RdBu_r"]
_FALL_60_DB = 6.9078
_LEGEND = (
    "Lowest modes: red and blue are what a push into the surface gives each, of either sign; white gives it "
    "nothing. Dot: the strike, pale where it is behind."
)


def spectrogram_pair(
    times: FloatArray, frequencies: FloatArray, recorded: FloatArray, simulated: FloatArray
) -> Figure:
    """A strike as it was heard, as the model rings at the answer, and the difference in dB.

    Levels are each drawn against the loudest of their own spectrogram, since the model's absolute
    level is an upper bound only. Where both lie below `FLOOR` the difference is drawn as none.

    Args:
        times: ``(n,)`` s from the strike.
        frequencies: ``(f,)`` Hz.
        recorded: ``(f, n)`` dB.
        simulated: ``(f, n)`` dB.

    Raises:
        ValueError: shapes do not agree, or a level is not finite.
    """
    for name, levels in (("recorded", recorded), ("simulated", simulated)):
        if levels.shape != (len(frequencies), len(times)) or not np.all(np.isfinite(levels)):
            raise ValueError(
                f"{name}: {levels.shape} levels for {len(frequencies)} frequencies and {len(times)} times, "
                "all finite"
            )
    heard, rung = (np.maximum(levels - levels.max(), FLOOR) for levels in (recorded, simulated))
    with styled():
        figure = blank(10.2, 3.5, "constrained")
        row = list(np.asarray(figure.subplots(1, 3, sharex=True, sharey=True)))
        _levels(row[0], times, frequencies, heard, "recorded", "magma", (FLOOR, 0.0))
        last = _levels(row[1], times, frequencies, rung, "simulated", "magma", (FLOOR, 0.0))
        figure.colorbar(last, ax=row[:2], label="dB", shrink=0.9, aspect=30)
        both = "recorded - simulated"
        apart = _levels(row[2], times, frequencies, heard - rung, both, "RdBu_r", (-_SPREAD, _SPREAD))
        figure.colorbar(apart, ax=row[2], label="dB", shrink=0.9, aspect=30)
        row[0].set_ylabel("frequency in kHz")
        for axes in row:
            axes.set_xlabel("ms from the strike")
    return figure


def _levels(
    axes: Axes,
    times: FloatArray,
    frequencies: FloatArray,
    levels: FloatArray,
    title: str,
    colours: str,
    limits: tuple[float, float],
) -> QuadMesh:
    drawn = axes.pcolormesh(
        1e3 * times,
        1e-3 * frequencies,
        levels,
        cmap=colours,
        vmin=limits[0],
        vmax=limits[1],
        shading="nearest",
        rasterized=True,
    )
    axes.set_title(title, fontsize=10)
    return drawn


def senses_figure(
    shots: Sequence[Shot], by_sense: Mapping[str, Posterior | Missing], truth: FloatArray | None = None
) -> Figure:
    """Where each sense believes the contact to be: a column a sense, a row a view of the object.

    Args:
        shots: square views of the object; fewer than 500 pixels do.
        by_sense: posteriors by the sense's name, in order; a sense that has none leaves the object bare.
        truth: ``(3,)`` metres, object frame.

    Raises:
        ValueError: there is no sense, or no view.
    """
    if not by_sense or not shots:
        raise ValueError("a picture of the senses needs the posterior of one at least, and a view of it")
    with styled():
        high = _SENSE_WIDTH * len(shots) + _TITLES
        figure = blank(_SENSE_WIDTH * len(by_sense), high)
        grid = np.asarray(figure.subplots(len(shots), len(by_sense), squeeze=False))
        figure.subplots_adjust(0.0, 0.0, 1.0, 1.0 - _TITLES / high, 0.02, 0.02)
        for (sense, found), column in zip(by_sense.items(), grid.T, strict=True):
            said = (
                "no answer" if isinstance(found, Missing) else f"90 % within {1e3 * found.credible90:.1f} mm"
            )
            column[0].set_title(
                f"{sense}\n{said}", fontsize=11, color=SOFT if isinstance(found, Missing) else INK
            )
            for axes, shot in zip(column, shots, strict=True):
                _believed(axes, shot, found, truth)
    return figure


def _believed(axes: Axes, shot: Shot, found: Posterior | Missing, truth: FloatArray | None) -> None:
    axes.set_axis_off()
    if isinstance(found, Missing):
        axes.imshow(shot.picture())
    else:
        axes.imshow(shot.picture(0, Heat(found)))
        mark(axes, shot, found.estimate, "P", ANSWER, _MARK)
    if truth is not None:
        mark(axes, shot, truth, "*", TRUTH, _MARK)


@dataclass(frozen=True, eq=False)
class ShownStrike:
    """What the picture shows."""

    title: str  #: above it.
    mesh: Mesh  #: m, in the object's frame.
    place: FloatArray  #: ``(3,)`` m, that was struck.
    sound: FloatArray  #: ``(t,)`` in any unit.
    rate: float  #: samples per second.
    frequencies: FloatArray  #: ``(m,)`` Hz, of the modes that are heard, ascending.
    dampings: FloatArray  #: ``(m,)`` 1/s.
    amplitudes: FloatArray  #: ``(m,)`` of each mode in the sound, not all zero.
    pushes: FloatArray
    """``(f, 3, k)``: what a push into each face gives the lowest ``k`` of the modes, at its corners."""


@dataclass(frozen=True)
class _Crop:
    """Pixels of a picture that are shown."""

    left: float
    right: float
    top: float
    bottom: float


def strike_figure(shown: ShownStrike) -> Figure:
    """The spectrogram, each mode's part in it, and the lowest modes' shapes on the object.

    The shapes are seen from one and the same side, from the opposite one where the strike is hidden
    in the first. Red is where a push into the surface gives a mode its one sign, blue the other, white a
    line at rest; each mode has a scale of its own. A decay time is that in which a mode falls by 60 dB.
    """
    count = min(SHOWN, shown.pushes.shape[2])
    rows = -(-count // _COLUMNS)
    sides = object_sides(shown.mesh, shown.mesh.bounds.mean(axis=0), _PIXELS)
    shot = next((shot for shot in sides.shots if not _hidden(shot, shown.place)), sides.shots[0])
    crop = _cropped(shot.picture())
    high = _TILE * (crop.bottom - crop.top) / (crop.right - crop.left)
    width, below = _COLUMNS * _TILE, rows * (high + _CAPTION) + _FOOT
    height = _TITLE + _SOUND + below
    with styled():
        figure = blank(width, height)
        figure.text(0.06, 1.0 - 0.5 * _TITLE / height, shown.title, va="center", fontsize=11)
        bottom, top = (below + 0.62) / height, 1.0 - (_TITLE + 0.12) / height
        heard = figure.add_axes((0.06, bottom, 0.60, top - bottom))
        _spectrogram(heard, shown)
        _mode_levels(figure.add_axes((0.70, bottom, 0.27, top - bottom), sharey=heard), shown, count)
        colours = _Shapes(shown.mesh, shown.pushes)
        for mode in range(count):
            row, column = divmod(mode, _COLUMNS)
            low = (below - (row + 1) * (high + _CAPTION) + _CAPTION) / height
            axes = figure.add_axes((column / _COLUMNS, low, 1.0 / _COLUMNS, high / height))
            axes.imshow(shot.picture(0, colours.paint(mode)))
            _label(axes, shot, crop, shown, mode)
        figure.text(0.5, 0.4 * _FOOT / height, _LEGEND, ha="center", va="center", fontsize=8.0, color=SOFT)
    return figure


def colourable(mesh: Mesh) -> Mesh:
    """The same surface in triangles so small that a mode may be linear in each: a box has twelve."""
    import trimesh  # here, because importing it takes a third of a second

    while _longest_edge(mesh) > _FINE * mesh.diagonal and 4 * len(mesh.faces) <= _MOST_FACES:
        finer = trimesh.remesh.subdivide(mesh.vertices, mesh.faces)  # type: ignore[no-untyped-call]
        mesh = Mesh(*finer)
    return mesh


def _longest_edge(mesh: Mesh) -> float:
    sides = mesh.corners - np.roll(mesh.corners, 1, axis=1)
    return float(np.linalg.norm(sides, axis=2).max())


def spectrogram(sound: FloatArray, rate: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``(n,)`` s, ``(f,)`` Hz and ``(f, n)`` dB against the loudest, at least ``FLOOR``; until it is silent.

    Args:
        sound: ``(t,)``, not silent.
        rate: samples per second.
    """
    size = np.abs(sound)
    last = int(np.flatnonzero(size >= 10.0 ** (MODE_FLOOR / 20.0) * size.max())[-1]) + 1
    lasting = min(max(int(1.1 * last), round(0.05 * rate)), len(sound))
    window = 1 << max(int(np.round(np.log2(_WINDOW * rate))), 4)
    padded = np.pad(sound[:lasting], (0, max(window - lasting, 0)))
    hop = max(len(padded) // _FRAMES, window // 8, 1)
    # Imported here, because it takes half a second and most commands do not need it.
    from scipy.signal import stft

    frequencies, times, found = stft(padded, rate, "hann", window, window - min(hop, window - 1))
    levels = 20.0 * np.log10(np.maximum(np.abs(found) / np.abs(found).max(), 10.0 ** (MODE_FLOOR / 20.0)))
    return times, frequencies, levels


def _spectrogram(axes: Axes, shown: ShownStrike) -> None:
    times, frequencies, levels = spectrogram(shown.sound, shown.rate)
    lowest, highest = 0.7 * float(shown.frequencies[0]), 1.1 * float(shown.frequencies[-1])
    seen = (frequencies >= lowest) & (frequencies <= highest)
    # The push of a long blow lies below every mode, and louder.
    loudest = float(levels[seen].max()) if seen.any() else 0.0
    axes.pcolormesh(
        times,
        1e-3 * frequencies[1:],
        levels[1:],
        cmap="magma",
        vmin=MODE_FLOOR,
        vmax=loudest,
        shading="nearest",
        rasterized=True,
    )
    # A logarithm, as ears have it; the lowest modes, which are drawn, else lie on each other.
    axes.set_yscale("log")
    axes.set_ylim(1e-3 * lowest, 1e-3 * min(highest, 0.5 * shown.rate))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlim(0.0, float(times[-1]))
    axes.set_xlabel("s from the first touch")
    axes.set_ylabel("frequency in kHz")


def _mode_levels(axes: Axes, shown: ShownStrike, count: int) -> None:
    levels = _decibels(shown.amplitudes)
    at = 1e-3 * shown.frequencies
    drawn = np.arange(len(at)) < count
    for some, colour in ((~drawn, SOFT), (drawn, TOOL)):
        axes.hlines(at[some], MODE_FLOOR, levels[some], colors=colour, lw=1.2)
        axes.plot(levels[some], at[some], "o", color=colour, ms=2.8)
    axes.set_xlim(MODE_FLOOR, 4.0)
    axes.set_xlabel("mode at its start, dB against the loudest")
    axes.tick_params(labelleft=False)


def _decibels(amplitudes: FloatArray) -> FloatArray:
    sizes = np.abs(amplitudes)
    return np.asarray(20.0 * np.log10(np.maximum(sizes / sizes.max(), 10.0 ** (MODE_FLOOR / 20.0))))


def _cropped(picture: FloatArray) -> _Crop:
    """Where something is, with a margin, and no higher than wide."""
    seen = np.any(picture < 0.995, axis=2)
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    margin = _MARGIN * float(max(np.ptp(rows), np.ptp(columns)))
    top, bottom = float(rows[0]) - margin, float(rows[-1]) + margin
    middle, half = 0.5 * float(columns[0] + columns[-1]), 0.5 * float(np.ptp(columns)) + margin
    half = max(half, 0.5 * (bottom - top))
    return _Crop(middle - half, middle + half, top, bottom)


def _hidden(shot: Shot, place: FloatArray) -> bool:
    return bool(shot.hidden(place[None], _LIFT)[0])


def _label(axes: Axes, shot: Shot, crop: _Crop, shown: ShownStrike, mode: int) -> None:
    axes.set_axis_off()
    pixel = shot.camera.project(shown.place[None])[0][0]
    strength = 0.3 if _hidden(shot, shown.place) else 1.0
    axes.scatter(
        float(pixel[0]), float(pixel[1]), s=34.0, c=INK, edgecolors="white", linewidths=1.0, alpha=strength
    )
    axes.set_xlim(crop.left, crop.right)
    axes.set_ylim(crop.bottom, crop.top)
    rate = float(shown.dampings[mode])
    lasting = f"60 dB in {_FALL_60_DB / rate:.2g} s" if rate > 0.0 else "undamped"
    level = float(_decibels(shown.amplitudes)[mode])
    said = f"here at {round(level)} dB" if level > MODE_FLOOR else "not struck here"
    axes.text(
        0.5,
        0.0,
        f"{mode + 1}:  {shown.frequencies[mode]:,.0f} Hz\n{lasting}, {said}",
        transform=axes.transAxes,
        ha="center",
        va="top",
        fontsize=8.5,
    )


class _Shapes:
    """Colours of a surface by numbers at its faces' corners.

    A shot asks for the same points with every painting of it: they are looked for once.
    """

    def __init__(self, mesh: Mesh, values: FloatArray) -> None:
        self._search = SurfaceSearch(mesh)
        self._values = values
        self._asked: FloatArray = np.empty((0, 3))
        self._at: tuple[IntArray, FloatArray] = (np.empty(0, np.int64), np.empty((0, 3)))

    def paint(self, mode: int) -> Paint:
        """Of a column of the values, by the greatest of it."""
        values = self._values[:, :, mode]
        greatest = max(float(np.abs(values).max()), 1e-300)

        def colours(points: FloatArray) -> tuple[FloatArray, FloatArray]:
            faces, shares = self._places(points)
            found = np.einsum("nc,nc->n", shares, values[faces]) / greatest
            return _DULL * np.asarray(_SHAPES(0.5 + 0.5 * found)[:, :3]), np.ones(len(points))

        return colours

    def _places(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        if not np.array_equal(points, self._asked):
            places, faces = self._search.nearest(points, 1e-3 * self._search.mesh.diagonal)
            self._asked, self._at = points, (faces, self._search.shares(places, faces))
        return self._at
