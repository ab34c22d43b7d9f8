"""The touch term's loops: crop, press, hang, compare.

Shapes: ``reading`` is the tuple ``(heights, pitch, touched, flat, skirt, edge)`` of a ``TouchMap``;
``sigmas`` is ``(rms, tilt, spin)`` of a ``TouchNoise``; ``scratch`` is ``(2, rows, columns)``, overwritten.
``lean`` is ``(LEAN,)`` numbers of a fit, overwritten: see ``leaning``.
"""

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled, copy_line
from harness.sim.gel.view import POOL

_CORE = 0.2
"""Share of the deepest place above which the object shapes the gel (Taxim, section III-A)."""


_HOPELESS = 150.0
"""Cost beyond which a term is capped whatever a second look would find."""


_SUNKEN = -6.0e-3
"""Metres: where the object is farther than this below its highest place, or absent, nothing is felt."""


Reading = tuple[FloatArray, float, IntArray, BoolArray, FloatArray, FloatArray]


Sigmas = tuple[float, float, float]


_WITHIN = 0.35
"""Pixels of the map, one sigma of how far a place may be from the nearest that is looked at."""


@compiled
def similarities_at(
    origin: FloatArray,
    view_pitch: float,
    depth: FloatArray,
    reading: Reading,
    places: FloatArray,
    behind: float,
) -> FloatArray:
    """Cosines between what the gel read and what it would have read at each place.

    Args:
        origin: ``(2,)`` metres, of the view along the tool.
        view_pitch: metres a pixel of it.
        depth: ``(rows, columns)`` metres of it.
        reading: of the gel.
        places: ``(n, 3)`` metres in view coordinates, on the object's surface.
        behind: metres; a place so far behind the first surface cannot be touched and scores 0.

    Returns:
        ``(n,)`` between 0 and 1.
    """
    heights, skirt, edge = reading[0], reading[4], reading[5]
    rows, columns = heights.shape
    crop, scratch = np.empty(heights.shape), np.empty((2, rows, columns))
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
        _hang(crop, skirt, edge, scratch)
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
def _solve3(a: FloatArray, b: FloatArray, plane: FloatArray, ridge: float) -> None:
    """Add the least-squares plane to ``plane``, its total tilt held to zero by ``ridge``.

    Cramer's rule on the symmetric normal equations, whose upper half is given.
    """
    a11, a22 = a[1, 1] + ridge, a[2, 2] + ridge
    a01, a02, a12 = a[0, 1], a[0, 2], a[1, 2]
    b0, b1, b2 = b[0], b[1] - ridge * plane[1], b[2] - ridge * plane[2]
    c00, c01, c02 = a11 * a22 - a12 * a12, a01 * a22 - a12 * a02, a01 * a12 - a11 * a02
    det = a[0, 0] * c00 - a01 * c01 + a02 * c02
    plane[0] += (b0 * c00 - a01 * (b1 * a22 - a12 * b2) + a02 * (b1 * a12 - a11 * b2)) / det
    plane[1] += (a[0, 0] * (b1 * a22 - a12 * b2) - b0 * c01 + a02 * (a01 * b2 - b1 * a02)) / det
    plane[2] += (a[0, 0] * (a11 * b2 - b1 * a12) - a01 * (a01 * b2 - b1 * a02) + b0 * c02) / det


@compiled
def score_at(
    depth: FloatArray,
    row: int,
    column: int,
    reading: Reading,
    sigmas: Sigmas,
    crop: FloatArray,
    pressed: FloatArray,
    scratch: FloatArray,
    lean: FloatArray,
) -> tuple[float, float]:
    """The term at one pixel of a view, and the depth along it of the gel's centre.

    ``pressed`` is left as the predicted reading, ``scratch[1]`` as the object's part in it.
    """
    heights, pitch, touched, _, skirt, edge = reading
    rows, columns = heights.shape
    reference = _crop(depth, row, column, crop)
    if not np.isfinite(reference):
        return -np.inf, np.nan
    # One tilt sigma weighs as much as one rms sigma of the whole map.
    ridge = (sigmas[0] / sigmas[1]) ** 2
    a, b, plane = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    for n in range(len(touched)):
        i, j = touched[n, 0], touched[n, 1]
        x, y = (j + 0.5 - 0.5 * columns) * pitch, (i + 0.5 - 0.5 * rows) * pitch
        _add(a, b, x, y, crop[i, j] - heights[i, j])
    _solve3(a, b, plane, len(touched) * ridge)
    _press(crop, plane, pitch, pressed)
    _hang(pressed, skirt, edge, scratch)
    cost = _misfit(pressed, reading, plane, sigmas)
    # A place that fits this badly is capped whatever a second look would find.
    if cost < _HOPELESS:
        # The gel hangs over edges, so the first fit, to the object's own shape, sinks too deep
        # there: what is left over where the object presses corrects it.
        a[:], b[:] = 0.0, 0.0
        for i in range(rows):
            for j in range(columns):
                if scratch[1, i, j] > 0.0:
                    x, y = (j + 0.5 - 0.5 * columns) * pitch, (i + 0.5 - 0.5 * rows) * pitch
                    _add(a, b, x, y, pressed[i, j] - heights[i, j])
        if a[0, 0] > 0.0:
            _solve3(a, b, plane, a[0, 0] * ridge)
            _press(crop, plane, pitch, pressed)
            _hang(pressed, skirt, edge, scratch)
            cost = _misfit(pressed, reading, plane, sigmas)
    put_lean(a, plane, sigmas, lean)
    cost -= slid(pressed, reading, sigmas, lean)
    return -0.5 * cost, reference - plane[0]


@compiled
def _misfit(pressed: FloatArray, reading: Reading, plane: FloatArray, sigmas: Sigmas) -> float:
    heights, flat, count = reading[0], reading[3], len(reading[2])
    total = 0.0
    for i in range(heights.shape[0]):
        for j in range(heights.shape[1]):
            gap = pressed[i, j] - heights[i, j]
            if flat[i, j]:
                gap = min(np.abs(gap), pressed[i, j])
            total += gap * gap
    return float(total / (count * sigmas[0] ** 2) + (plane[1] ** 2 + plane[2] ** 2) / sigmas[1] ** 2)


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
def _hang(image: FloatArray, skirt: FloatArray, edge: FloatArray, scratch: FloatArray) -> None:
    """The gel's skirt: blurred, with what the object surely shapes put back (Taxim, section III-A)."""
    work, kept = scratch[0], scratch[1]
    core = _CORE * image.max()
    for i in range(image.shape[0]):
        copy_line(kept[i], image[i])
    _blur(image, skirt, work)
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            if kept[i, j] > core:
                image[i, j] = kept[i, j]
    _blur(image, edge, work)


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
def fill_scores(
    depth: FloatArray,
    score: FloatArray,
    gel_depth: FloatArray,
    lean: FloatArray,
    reading: Reading,
    sigmas: Sigmas,
    pixels: AnyArray,
) -> None:
    """Fill in ``score``, ``gel_depth`` and ``lean`` at ``(n, 2)`` pixels."""
    shape = reading[0].shape
    crop, pressed, scratch = np.empty(shape), np.empty(shape), np.empty((2, shape[0], shape[1]))
    for n in range(len(pixels)):
        r, c = pixels[n, 0], pixels[n, 1]
        if np.isnan(score[r, c]):
            score[r, c], gel_depth[r, c] = score_at(
                depth, r, c, reading, sigmas, crop, pressed, scratch, lean[r, c]
            )


@compiled
def _spread(rings: int, spacing: float) -> float:
    """What the prior of the shifts sums to over the cells, so that a sure match costs nothing."""
    total = 0.0
    for u in range(-rings, rings + 1):
        for v in range(-rings, rings + 1):
            total += np.exp(-0.5 * (u * u + v * v) * spacing**2)
    return float(total)


@compiled
def terms_at(
    origin: FloatArray,
    view_pitch: float,
    depth: FloatArray,
    nearest: FloatArray,
    farthest: FloatArray,
    score: FloatArray,
    gel_depth: FloatArray,
    lean: FloatArray,
    reading: Reading,
    sigmas: Sigmas,
    places: FloatArray,
    turns: FloatArray,
    step: int,
    rings: int,
    shift: float,
    depth_sigma: float,
    cap: float,
    temperature: float,
) -> FloatArray:
    """Log-likelihoods; see ``touch.touch_terms``."""
    shape = reading[0].shape
    crop, pressed, scratch = np.empty(shape), np.empty(shape), np.empty((2, shape[0], shape[1]))
    terms = np.empty(len(places))
    around = np.empty((2 * rings + 1) ** 2)
    spread = _spread(rings, step * view_pitch / shift)
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
                    score[r, c], gel_depth[r, c] = score_at(
                        depth, r, c, reading, sigmas, crop, pressed, scratch, lean[r, c]
                    )
                if score[r, c] == -np.inf:
                    continue
                dx, dy = (c - column) * view_pitch, (r - row) * view_pitch
                dz = (places[n, 2] - gel_depth[r, c]) / depth_sigma
                told = score[r, c] + leaning(lean[r, c], turns[n, 0], turns[n, 1], turns[n, 2])
                value = temperature * told - 0.5 * ((dx * dx + dy * dy) / (shift * shift) + dz * dz)
                around[count] = value
                count += 1
                best = max(best, value)
        total = -np.inf
        if count > 0 and best > -np.inf:
            total = best + np.log(np.sum(np.exp(around[:count] - best)) / spread)
        # A mixture with an outlier: smooth, and never more costly than the cap.
        terms[n] = np.logaddexp(total, -cap)
    return terms


@compiled
def put_lean(a: FloatArray, plane: FloatArray, sigmas: Sigmas, lean: FloatArray) -> None:
    """What ``leaning`` needs of a fit, from its normal equations and the plane that it found."""
    variance = sigmas[1] ** 2
    lean[0], lean[1] = plane[1] / variance, plane[2] / variance
    lean[2] = lean[3] = lean[4] = 0.0
    if a[0, 0] > 0.0:
        # How well the image tells the tilts, its depth free; the prior's precision is one in these units.
        told = variance / (a[0, 0] * sigmas[0] ** 2)
        xx = 1.0 + told * (a[1, 1] - a[0, 1] * a[0, 1] / a[0, 0])
        yy = 1.0 + told * (a[2, 2] - a[0, 2] * a[0, 2] / a[0, 0])
        xy = told * (a[1, 2] - a[0, 1] * a[0, 2] / a[0, 0])
        det = xx * yy - xy * xy
        lean[2] = (1.0 - yy / det) / variance
        lean[3] = xy / det / variance
        lean[4] = (1.0 - xx / det) / variance


@compiled
def slid(pressed: FloatArray, reading: Reading, sigmas: Sigmas, lean: FloatArray) -> float:
    """By how much the cost falls where the picture is slid and turned in its own plane as fits best.

    To first order. It is slid within a pixel, between the places that are looked at: without that an edge
    fits some of them by chance, far better than their neighbours. ``lean`` is left as ``leaning`` needs it.
    """
    heights, flat = reading[0], reading[3]
    rows, columns = heights.shape
    xx = yy = tt = xy = xt = yt = bx = by = bt = 0.0
    for i in range(1, rows - 1):
        for j in range(1, columns - 1):
            if flat[i, j]:
                continue
            across = 0.5 * (pressed[i, j + 1] - pressed[i, j - 1])
            down = 0.5 * (pressed[i + 1, j] - pressed[i - 1, j])
            # A turn moves places by (-y, x), in pixels as the slopes are.
            turn = (j + 0.5 - 0.5 * columns) * down - (i + 0.5 - 0.5 * rows) * across
            gap = heights[i, j] - pressed[i, j]
            xx += across * across
            yy += down * down
            tt += turn * turn
            xy += across * down
            xt += across * turn
            yt += down * turn
            bx += across * gap
            by += down * gap
            bt += turn * gap
    unit = len(reading[2]) * sigmas[0] ** 2
    about, within = unit / sigmas[2] ** 2, unit / _WITHIN**2
    xx, yy, tt = xx + within, yy + within, tt + about
    c_xx, c_xy, c_xt = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy
    c_yy, c_yt, c_tt = xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy
    det = xx * c_xx + xy * c_xy + xt * c_xt
    x = (c_xx * bx + c_xy * by + c_xt * bt) / det
    y = (c_xy * bx + c_yy * by + c_yt * bt) / det
    turn = (c_xt * bx + c_yt * by + c_tt * bt) / det
    # Farther than a pixel the slopes are others.
    share = min(1.0, 1.0 / max(np.abs(x), np.abs(y), 1e-9))
    lean[5] = share * turn / sigmas[2] ** 2
    lean[6] = (1.0 - about * c_tt / det) / sigmas[2] ** 2
    return float(share * (2.0 - share) * (bx * x + by * y + bt * turn) / unit)


@compiled
def leaning(lean: FloatArray, tilt_x: float, tilt_y: float, spin: float) -> float:
    """Nats that a score gains where the gel is expected to be turned by so much, not by nothing.

    The fit's prior is about no turn. Moved to another, the least cost changes by the terms of a quadratic
    whose curvature is the fit's own: along what the image does not tell it changes nothing.
    """
    return float(
        lean[0] * tilt_x
        + lean[1] * tilt_y
        + lean[5] * spin
        - 0.5 * lean[6] * spin * spin
        - 0.5 * (lean[2] * tilt_x * tilt_x + 2.0 * lean[3] * tilt_x * tilt_y + lean[4] * tilt_y * tilt_y)
    )


@compiled
def leanings_at(leans: FloatArray, tilt_x: float, tilt_y: float, spin: float) -> FloatArray:
    """``(n,)``: see ``leaning``, of ``(n, LEAN)`` fits."""
    result = np.empty(len(leans))
    for n in range(len(leans)):
        result[n] = leaning(leans[n], tilt_x, tilt_y, spin)
    return result
