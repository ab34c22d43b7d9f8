"""Laws of derivatives: what is held in place leads the right way, and none depends on how it is come by."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.contact_rows import contact_row_count
from experiments.shape_reconstruction.family.freedom import basis_of, stand_basis
from experiments.shape_reconstruction.family.observed import observe
from experiments.shape_reconstruction.family.residuals import (
    NUDGE,
    active_rows,
    evaluate,
    fill_frozen,
    first_prior_row,
    first_ray,
    hold_rays,
    make_rows,
    prepared_buffer,
    slopes_along,
)
from tests.support.family_readings import ended_at, made, nudged
from tests.support.family_shapes import SHAPES


@pytest.mark.parametrize("name", SHAPES)
def test_contacts_have_the_exact_slope_and_held_rays_one_that_leads_down(name: str) -> None:
    shape, evidence = made(name)
    # Places said to be clear that lie in the shape, some of them, pull too.
    touches = tuple(replace(one, clear=one.points - 6e-3 * one.normals) for one in evidence.touches)
    supposed = np.concatenate([one.points + 2e-3 for one in touches])
    seen = observe(replace(evidence, touches=touches, prior_points=supposed))
    theta = nudged(shape, 0.05)
    out, q = make_rows(seen), prepared_buffer()
    evaluate(shape.code, theta, seen, False, out, q, np.inf)
    rows = active_rows(seen, out.values)
    base, moved = np.empty(len(rows)), np.empty(len(rows))
    hold_rays(shape.code, theta, seen, rows, out, q)
    fill_frozen(shape.code, theta, seen, rows, out, False, q, base)
    first = contact_row_count(seen) + len(seen.free)
    seen_by_rays = (rows >= first) & (rows < first + len(seen.rays.kinds))
    np.testing.assert_allclose(base[~seen_by_rays], out.values[rows][~seen_by_rays], atol=1e-9)
    # A ray is held where it is nearest, which is found to half a step as costs are computed.
    assert np.all(base[seen_by_rays] < out.values[rows][seen_by_rays] + 0.15)
    direction = np.zeros(len(theta))
    direction[layout.X] = 0.5e-3  # far beyond what a ray searched anew may be off
    fill_frozen(shape.code, theta + direction, seen, rows, out, False, q, moved)
    again = make_rows(seen)
    evaluate(shape.code, theta + direction, seen, False, again, q, np.inf)
    contacts, count = rows < contact_row_count(seen), len(seen.prior_points)
    assert (rows[contacts] >= len(seen.points) + 3 * len(seen.middles)).any()
    assert np.array_equal(again.values[rows][contacts], moved[contacts])
    assert 0 < count == np.sum(rows >= len(make_rows(seen).values) - count)
    assert np.array_equal(again.values[-count:], moved[-count:])
    rows, contacts, base, moved = rows[:-count], contacts[:-count], base[:-count], moved[:-count]
    # Along a flat side a ray's nearest place jumps as the shape moves: held there, it is off by that.
    true, held = again.values[rows] - out.values[rows], moved - base
    assert true @ held > 0.5 * np.linalg.norm(true) * np.linalg.norm(held)
    assert np.linalg.norm(held) == pytest.approx(np.linalg.norm(true), rel=0.2)


@pytest.mark.parametrize("name", SHAPES)
def test_the_slope_along_every_direction_is_that_of_its_rows(name: str) -> None:
    shape, evidence = ended_at(name, 2e-3)
    # Places said to be clear that lie in the shape, some of them, pull too.
    touches = tuple(replace(one, clear=one.points - 4e-3 * one.normals) for one in evidence.touches)
    supposed = np.concatenate([one.points + 2e-3 for one in touches])
    seen = observe(replace(evidence, touches=touches, prior_points=supposed))
    theta = nudged(shape, 0.05)
    assert np.all(theta[[layout.CAMERA_RIGHT, layout.CAMERA_SCALE, layout.GEL, layout.TILT_X]] != 0.0)
    out, q = make_rows(seen), prepared_buffer()
    evaluate(shape.code, theta, seen, False, out, q, np.inf)
    rows = active_rows(seen, out.values)
    every = basis_of(shape.code, True, True)
    basis = np.concatenate([every, stand_basis(shape.code, True), every[:1] + every[-1:]])
    slopes = slopes_along(shape.code, theta, seen, basis, rows, out, q)
    base, moved = np.empty(len(rows)), np.empty(len(rows))
    fill_frozen(shape.code, theta, seen, rows, out, False, q, base)
    ends = (contact_row_count(seen), first_ray(seen), first_prior_row(seen), len(make_rows(seen).values))
    kinds = np.searchsorted(ends, rows, side="right")
    assert set(kinds) == {0, 1, 2, 3}
    for direction, slope in zip(basis, slopes, strict=True):
        fill_frozen(shape.code, theta + NUDGE * direction, seen, rows, out, False, q, moved)
        true = (moved - base) / NUDGE
        for kind in range(len(ends)):
            found, asked = slope[kinds == kind], true[kinds == kind]
            # At an edge of the shape a place has a slope to either side: one row may be there.
            off = np.sort(np.abs(found - asked))[:-1]
            assert np.linalg.norm(off) <= 0.02 * np.linalg.norm(asked) + 1e-6


_FIT = """
import numpy as np
from experiments.shape_reconstruction.family.kinds import CLASSES, draw_shape
from experiments.shape_reconstruction.family.search import FamilySearch
from experiments.shape_reconstruction.family.search import LEVELS
from tests.support.family_readings import made
search, random = FamilySearch(made("mug")[1], LEVELS["coarse"]), np.random.default_rng(3)
for other in [draw_shape(name, random) for name in CLASSES for _ in range(12)]:
    found = search.refine(search.start(other, other.theta), 2, last=True)
    print(found.cost.hex(), *(number.hex() for number in found.shape.theta.tolist()))
"""


@pytest.mark.slow  # compiles the whole family, 40 s
def test_a_fit_has_the_same_bits_when_its_kernels_were_just_compiled_and_when_they_were_kept(
    tmp_path: Path,
) -> None:
    kept = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(Path.cwd())}
    first, second = (
        subprocess.run([sys.executable, "-c", _FIT], env=kept, capture_output=True, text=True, check=True)
        for _ in range(2)
    )
    assert any(tmp_path.rglob("*.nbc"))
    assert len(first.stdout.splitlines()) >= 100
    assert first.stdout == second.stdout
