"""The touch term: does the object, seen along the tool, look there as the gel says it does?

With the tool's attitude known, what the gel would read at every place of the object is a
crop of one orthographic depth image along the tool's axis: one render answers for all
candidates of a contact, and what stands in the way of the sensor is in the picture.
"""

from dataclasses import dataclass

import numpy as np

from harness.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.sim.compiled import compiled

_CORE = 0.2
_HOPELESS = 150.0

POOL = 4
"""Pixels of a view, each way, that share the limits on where the gel can be."""

_SUNKEN = -6.0e-3
"""Where the object is farther than this below its highest place, or absent, the gel reads nothing."""


LEVEL_SLOPE = 0.06
"""Mean slope of a pixel below which it may be the gel at rest."""


@dataclass(frozen=True)
class TouchNoise:
    """How far a recovered height map may be from the predicted one.

    Attributes:
        rms: metres, root mean square over the touched area at the true place, one sigma.
        tilt: rad, one sigma about each axis of the image: sensor frame and object's attitude.
        skirt: metres, sigma of the blur that stands for the gel hanging from the contact.
        edge: metres, sigma of the blur over the contact's own edges: what the sensor cannot resolve.
        shift: metres, one sigma in the plane of the gel of where the arm says a contact was
            relative to the others.
        depth: metres, one sigma across it.
        cap: the most that one contact may cost, nats.
    """

    rms: float = 0.064e-3
    tilt: float = np.radians(1.75)
    skirt: float = 1.0e-3
    edge: float = 0.6e-3
    shift: float = 0.6e-3
    depth: float = 0.6e-3
    cap: float = 12.0


@dataclass(frozen=True, eq=False)
class TouchMap:
    """What the gel read at one contact, reduced to what the term compares.

    Attributes:
        heights: ``(rows, columns)`` metres of indentation, at ``pitch``.
        pitch: metres.
        touched: ``(n, 2)`` row and column of the pixels surely in contact; empty for a contact
            that the image does not show.
        flat: ``(rows, columns)`` where the gel is level: pressed by something level, or at rest
            beyond an edge too steep for its height to be read from the colour.
        blur: ``(m,)`` one half of the skirt's kernel, from its centre out.
        finish: ``(m,)`` one half of the kernel that softens the contact's own edges.
    """

    heights: FloatArray
    pitch: float
    touched: IntArray
    flat: BoolArray
    blur: FloatArray
    finish: FloatArray


@dataclass(frozen=True, eq=False)
class View:
    """The object seen along the tool, with the touch term at each place filled in on demand.

    Attributes:
        object_from_view: ``(3, 3)``, columns x and y of the gel's image and z along the tool.
        origin: ``(2,)`` metres, view x and y of the centre of pixel (0, 0).
        pitch: metres a pixel, half of the touch map's.
        depth: ``(rows, columns)`` metres along z of the first surface, inf where there is none.
        nearest: for blocks of ``POOL`` pixels each way, metres along z: the gel's centre cannot be
            nearer to the arm, or nothing would touch it.
        farthest: for the same blocks, metres along z: it cannot be farther, or the object would
            reach through the gel.
        score: ``(rows, columns)`` nats, NaN where not asked for yet.
        gel_depth: ``(rows, columns)`` metres along z of the gel's centre, from the fit.
    """

    object_from_view: FloatArray
    origin: FloatArray
    pitch: float
    depth: FloatArray
    nearest: FloatArray
    farthest: FloatArray
    score: FloatArray
    gel_depth: FloatArray


def touch_map(
    heights: FloatArray, pitch: float, block: int, skirt: float, edge: float, threshold: float
) -> TouchMap:
    """A height map averaged over blocks of pixels.

    Args:
        heights: ``(rows, columns)`` metres of indentation.
        pitch: metres a pixel.
        block: pixels a side; rows and columns left over are cut evenly at both ends.
        skirt: metres, sigma of the gel's blur around a contact.
        edge: metres, sigma of the blur of the contact itself.
        threshold: metres; a map that rises no higher shows no contact.
    """
    rows, columns = heights.shape[0] // block, heights.shape[1] // block
    top, left = (heights.shape[0] - rows * block) // 2, (heights.shape[1] - columns * block) // 2
    cut = heights[top : top + rows * block, left : left + columns * block]
    coarse = cut.reshape(rows, block, columns, block).mean(axis=(1, 3))
    peak = float(coarse.max())
    core = coarse > max(threshold, 0.4 * peak)
    touched = np.argwhere(core) if peak > threshold else np.empty((0, 2), dtype=np.int64)
    coarse_pitch = pitch * block
    return TouchMap(
        read_only(np.ascontiguousarray(coarse)),
        coarse_pitch,
        read_only(touched),
        read_only(_level(cut, pitch, block) & (coarse > 0.0)),
        read_only(_half_kernel(skirt / coarse_pitch)),
        read_only(_half_kernel(edge / coarse_pitch)),
    )


def _half_kernel(sigma: float) -> FloatArray:
    """A Gaussian of ``sigma`` pixels from its centre out, all of it summing to 1."""
    kernel = np.exp(-0.5 * (np.arange(int(np.ceil(2.5 * sigma)) + 1) / sigma) ** 2)
    return np.asarray(kernel / (kernel[0] + 2.0 * kernel[1:].sum()))


def _level(heights: FloatArray, pitch: float, block: int) -> BoolArray:
    down, right = np.gradient(heights, pitch)
    steep = np.hypot(down, right)
    rows, columns = heights.shape[0] // block, heights.shape[1] // block
    mean = steep.reshape(rows, block, columns, block).mean(axis=(1, 3))
    return np.asarray(mean < LEVEL_SLOPE)


def view_scores(view: View, touch: TouchMap, noise: TouchNoise, pixels: IntArray) -> None:
    """Fill in the touch term at ``(n, 2)`` pixels (row, column) of a view."""
    _fill(
        view.depth,
        view.score,
        view.gel_depth,
        touch.heights,
        touch.pitch,
        touch.touched,
        touch.flat,
        touch.blur,
        touch.finish,
        noise.rms,
        noise.tilt,
        pixels,
    )


def touch_terms(
    view: View,
    touch: TouchMap,
    noise: TouchNoise,
    places: FloatArray,
    step: int,
    rings: int,
    shift: float,
    temperature: float,
) -> FloatArray:
    """Log-likelihood of one contact's image and place under each hypothesis.

    The arm's error is integrated out: the contact may have been at any of the cells around
    the place that a hypothesis gives it, each at the price of its distance.

    Args:
        view: along the tool, under the hypotheses' yaw.
        touch: what the gel read.
        noise: of the term.
        places: ``(n, 3)`` metres in view coordinates: the gel's centre, x, y and depth.
        step: pixels between cells.
        rings: cells looked at on each side.
        shift: metres, one sigma of the place in the plane of the gel.
        temperature: factor on the image's share.

    Returns:
        ``(n,)`` nats, not below ``-noise.cap``.
    """
    return _terms(
        view.origin,
        view.pitch,
        view.depth,
        view.nearest,
        view.farthest,
        view.score,
        view.gel_depth,
        touch.heights,
        touch.pitch,
        touch.touched,
        touch.flat,
        touch.blur,
        touch.finish,
        noise.rms,
        noise.tilt,
        places,
        step,
        rings,
        shift,
        noise.depth,
        noise.cap,
        temperature,
    )


def best_fit(view: View, touch: TouchMap, noise: TouchNoise, place: FloatArray, shift: float) -> float:
    """How well a contact fits near one place: nats of its best cell, untempered and uncapped.

    Args:
        view: along the tool.
        touch: what the gel read.
        noise: of the term.
        place: ``(3,)`` metres in view coordinates: the gel's centre.
        shift: metres, one sigma of the place in the plane of the gel.
    """
    rings = int(np.ceil(3.0 * shift / view.pitch))
    column, row = np.round((place[:2] - view.origin) / view.pitch).astype(np.int64)
    around = np.arange(-rings, rings + 1)
    rows, columns = view.depth.shape
    r, c = (a.ravel() for a in np.meshgrid(row + around, column + around, indexing="ij"))
    inside = (r >= 0) & (r < rows) & (c >= 0) & (c < columns)
    r, c = r[inside], c[inside]
    view_scores(view, touch, noise, np.ascontiguousarray(np.column_stack([r, c])))
    dx = view.origin[0] + c * view.pitch - place[0]
    dy = view.origin[1] + r * view.pitch - place[1]
    dz = place[2] - view.gel_depth[r, c]
    cost = (dx**2 + dy**2) / shift**2 + (dz / noise.depth) ** 2
    fits = view.score[r, c] - 0.5 * np.where(np.isfinite(cost), cost, np.inf)
    return float(fits.max(initial=-np.inf))


def similarities(view: View, touch: TouchMap, places: FloatArray, behind: float = 1.5e-3) -> FloatArray:
    """Cosine between what the gel read and what it would have read at each place.

    Args:
        view: along the tool.
        touch: what the gel read.
        places: ``(n, 3)`` metres in view coordinates, on the object's surface.
        behind: metres; a place so far behind the first surface cannot be touched and scores 0.

    Returns:
        ``(n,)`` between 0 and 1.
    """
    return _similarities(
        view.origin, view.pitch, view.depth, touch.heights, touch.blur, touch.finish, places, behind
    )


@compiled
def _similarities(
    origin: FloatArray,
    view_pitch: float,
    depth: FloatArray,
    heights: FloatArray,
    blur: FloatArray,
    finish: FloatArray,
    places: FloatArray,
    behind: float,
) -> FloatArray:
    rows, columns = heights.shape
    crop, work, kept = np.empty(heights.shape), np.empty(heights.shape), np.empty(heights.shape)
    result = np.zeros(len(places))
    for n in range(len(places)):
        column = int(np.round((places[n, 0] - origin[0]) / view_pitch))
        row = int(np.round((places[n, 1] - origin[1]) / view_pitch))
        if row < 0 or column < 0 or row >= depth.shape[0] or column >= depth.shape[1]:
            continue
        if not np.abs(depth[row, column] - places[n, 2]) < behind:
            continue
        _crop(depth, row, column, crop)
        # The press is unknown: as deep as the reading's deepest point.
        lift = crop.max() - heights.max()
        for i in range(rows):
            for j in range(columns):
                crop[i, j] = max(0.0, crop[i, j] - lift)
        _hang(crop, blur, finish, work, kept)
        both = np.sqrt(np.sum(crop * crop) * np.sum(heights * heights))
        if both > 0.0:
            result[n] = max(0.0, np.sum(crop * heights) / both)
    return result


@compiled
def _crop(depth: FloatArray, row: int, column: int, crop: FloatArray) -> float:
    """Heights at every second pixel around a pixel, over the greatest of them; its depth is returned.

    Two view pixels make one of the map, so every map pixel's centre is a view pixel whether
    the map's sides are even or odd.
    """
    rows, columns = crop.shape
    top, left = row - (rows - 1), column - (columns - 1)
    reference = np.inf
    for i in range(rows):
        for j in range(columns):
            r, c = top + 2 * i, left + 2 * j
            crop[i, j] = np.inf
            if 0 <= r < depth.shape[0] and 0 <= c < depth.shape[1]:
                crop[i, j] = depth[r, c]
                reference = min(reference, depth[r, c])
    for i in range(rows):
        for j in range(columns):
            crop[i, j] = max(_SUNKEN, reference - crop[i, j])
    return float(reference)


@compiled
def _solve3(a: FloatArray, b: FloatArray, plane: FloatArray, ridge: float, change: FloatArray) -> None:
    """Add the least-squares plane to ``plane``, its total tilt held to zero by ``ridge``.

    Cramer's rule on the symmetric normal equations, whose upper half is given.
    """
    a11, a22 = a[1, 1] + ridge, a[2, 2] + ridge
    a01, a02, a12 = a[0, 1], a[0, 2], a[1, 2]
    b0, b1, b2 = b[0], b[1] - ridge * plane[1], b[2] - ridge * plane[2]
    c00, c01, c02 = a11 * a22 - a12 * a12, a01 * a22 - a12 * a02, a01 * a12 - a11 * a02
    det = a[0, 0] * c00 - a01 * c01 + a02 * c02
    change[0] = (b0 * c00 - a01 * (b1 * a22 - a12 * b2) + a02 * (b1 * a12 - a11 * b2)) / det
    change[1] = (a[0, 0] * (b1 * a22 - a12 * b2) - b0 * c01 + a02 * (a01 * b2 - b1 * a02)) / det
    change[2] = (a[0, 0] * (a11 * b2 - b1 * a12) - a01 * (a01 * b2 - b1 * a02) + b0 * c02) / det
    plane += change


@compiled
def _score(
    depth: FloatArray,
    row: int,
    column: int,
    heights: FloatArray,
    pitch: float,
    touched: IntArray,
    flat: BoolArray,
    blur: FloatArray,
    finish: FloatArray,
    rms: float,
    tilt: float,
    crop: FloatArray,
    work: FloatArray,
    kept: FloatArray,
    pressed: FloatArray,
) -> tuple[float, float]:
    """The term at one pixel, and the depth of the gel's centre above it, along the view."""
    rows, columns = heights.shape
    reference = _crop(depth, row, column, crop)
    if not np.isfinite(reference):
        return -np.inf, np.nan
    # One tilt sigma weighs as much as one rms sigma of the whole map.
    ridge = (rms / tilt) ** 2
    a, b, plane, change = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.empty(3)
    for n in range(len(touched)):
        i, j = touched[n, 0], touched[n, 1]
        x, y = (j + 0.5 - 0.5 * columns) * pitch, (i + 0.5 - 0.5 * rows) * pitch
        _add(a, b, x, y, crop[i, j] - heights[i, j])
    _solve3(a, b, plane, len(touched) * ridge, change)
    _press(crop, plane, pitch, pressed)
    _hang(pressed, blur, finish, work, kept)
    cost = _misfit(pressed, heights, flat, plane, len(touched), rms, tilt)
    # A place that fits this badly is capped whatever a second look would find.
    if cost < _HOPELESS:
        # The gel hangs over edges, so the first fit, to the object's own shape, sinks too deep
        # there: what is left over where the object presses corrects it.
        a[:], b[:] = 0.0, 0.0
        for i in range(rows):
            for j in range(columns):
                if kept[i, j] > 0.0:
                    x, y = (j + 0.5 - 0.5 * columns) * pitch, (i + 0.5 - 0.5 * rows) * pitch
                    _add(a, b, x, y, pressed[i, j] - heights[i, j])
        if a[0, 0] > 0.0:
            _solve3(a, b, plane, a[0, 0] * ridge, change)
            _press(crop, plane, pitch, pressed)
            _hang(pressed, blur, finish, work, kept)
            cost = _misfit(pressed, heights, flat, plane, len(touched), rms, tilt)
    crop[:] = pressed
    return -0.5 * cost, reference - plane[0]


@compiled
def _misfit(
    pressed: FloatArray,
    heights: FloatArray,
    flat: BoolArray,
    plane: FloatArray,
    count: int,
    rms: float,
    tilt: float,
) -> float:
    total = 0.0
    for i in range(heights.shape[0]):
        for j in range(heights.shape[1]):
            gap = pressed[i, j] - heights[i, j]
            if flat[i, j]:
                gap = min(np.abs(gap), pressed[i, j])
            total += gap * gap
    return float(total / (count * rms * rms) + (plane[1] ** 2 + plane[2] ** 2) / (tilt * tilt))


@compiled
def _add(a: FloatArray, b: FloatArray, x: float, y: float, gap: float) -> None:
    a[0, 0] += 1.0
    a[0, 1] += x
    a[0, 2] += y
    a[1, 1] += x * x
    a[1, 2] += x * y
    a[2, 2] += y * y
    b[0] += gap
    b[1] += x * gap
    b[2] += y * gap


@compiled
def _press(crop: FloatArray, plane: FloatArray, pitch: float, pressed: FloatArray) -> None:
    """How deep the object reaches into a gel at rest in a plane."""
    rows, columns = crop.shape
    for i in range(rows):
        y = (i + 0.5 - 0.5 * rows) * pitch
        for j in range(columns):
            x = (j + 0.5 - 0.5 * columns) * pitch
            pressed[i, j] = max(0.0, crop[i, j] - plane[0] - plane[1] * x - plane[2] * y)


@compiled
def _hang(
    image: FloatArray, kernel: FloatArray, finish: FloatArray, work: FloatArray, kept: FloatArray
) -> None:
    """The gel's skirt: blurred, with what the object surely shapes put back (Taxim, section III-A)."""
    core = _CORE * image.max()
    kept[:] = image
    _blur(image, kernel, work)
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            if kept[i, j] > core:
                image[i, j] = kept[i, j]
    _blur(image, finish, work)


@compiled
def _blur(image: FloatArray, kernel: FloatArray, work: FloatArray) -> None:
    rows, columns = image.shape
    for i in range(rows):
        for j in range(columns):
            total = kernel[0] * image[i, j]
            for k in range(1, len(kernel)):
                total += kernel[k] * (image[i, max(j - k, 0)] + image[i, min(j + k, columns - 1)])
            work[i, j] = total
    for i in range(rows):
        for j in range(columns):
            total = kernel[0] * work[i, j]
            for k in range(1, len(kernel)):
                total += kernel[k] * (work[max(i - k, 0), j] + work[min(i + k, rows - 1), j])
            image[i, j] = total


@compiled
def _fill(
    depth: FloatArray,
    score: FloatArray,
    gel_depth: FloatArray,
    heights: FloatArray,
    pitch: float,
    touched: IntArray,
    flat: BoolArray,
    blur: FloatArray,
    finish: FloatArray,
    rms: float,
    tilt: float,
    pixels: AnyArray,
) -> None:
    shape = heights.shape
    crop, work, kept, pressed = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    for n in range(len(pixels)):
        r, c = pixels[n, 0], pixels[n, 1]
        if np.isnan(score[r, c]):
            score[r, c], gel_depth[r, c] = _score(
                depth, r, c, heights, pitch, touched, flat, blur, finish, rms, tilt, crop, work, kept, pressed
            )


@compiled
def _terms(
    origin: FloatArray,
    view_pitch: float,
    depth: FloatArray,
    nearest: FloatArray,
    farthest: FloatArray,
    score: FloatArray,
    gel_depth: FloatArray,
    heights: FloatArray,
    pitch: float,
    touched: IntArray,
    flat: BoolArray,
    blur: FloatArray,
    finish: FloatArray,
    rms: float,
    tilt: float,
    places: FloatArray,
    step: int,
    rings: int,
    shift: float,
    depth_sigma: float,
    cap: float,
    temperature: float,
) -> FloatArray:
    shape = heights.shape
    crop, work, kept, pressed = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    terms = np.empty(len(places))
    around = np.empty((2 * rings + 1) ** 2)
    # What the shifts' prior leaves on a grid of cells, so that a sure match costs nothing.
    spread = 0.0
    for u in range(-rings, rings + 1):
        for v in range(-rings, rings + 1):
            spread += np.exp(-0.5 * (u * u + v * v) * (step * view_pitch / shift) ** 2)
    for n in range(len(places)):
        column = (places[n, 0] - origin[0]) / view_pitch
        row = (places[n, 1] - origin[1]) / view_pitch
        middle_r, middle_c = int(np.round(row / step)) * step, int(np.round(column / step)) * step
        count, best = 0, -np.inf
        for u in range(-rings, rings + 1):
            for v in range(-rings, rings + 1):
                r, c = middle_r + u * step, middle_c + v * step
                if r < 0 or c < 0 or r >= depth.shape[0] or c >= depth.shape[1]:
                    continue
                if not nearest[r // POOL, c // POOL] < places[n, 2] < farthest[r // POOL, c // POOL]:
                    continue
                if np.isnan(score[r, c]):
                    score[r, c], gel_depth[r, c] = _score(
                        depth,
                        r,
                        c,
                        heights,
                        pitch,
                        touched,
                        flat,
                        blur,
                        finish,
                        rms,
                        tilt,
                        crop,
                        work,
                        kept,
                        pressed,
                    )
                if score[r, c] == -np.inf:
                    continue
                dx, dy = (c - column) * view_pitch, (r - row) * view_pitch
                dz = (places[n, 2] - gel_depth[r, c]) / depth_sigma
                value = temperature * score[r, c] - 0.5 * ((dx * dx + dy * dy) / (shift * shift) + dz * dz)
                around[count] = value
                count += 1
                best = max(best, value)
        total = -np.inf
        if count > 0 and best > -np.inf:
            total = best + np.log(np.sum(np.exp(around[:count] - best)) / spread)
        # A mixture with an outlier: smooth, and never more costly than the cap.
        terms[n] = np.logaddexp(total, -cap)
    return terms
