"""The strip of a shape's estimates: one picture each, at one size and in one scale of colours."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from harness.report.figures.shape import KnownSurface, SurfaceThen, strip_figure

MUG = build("mug", 8e-3)


def then(number: int, scale: float, deviation: float) -> SurfaceThen:
    mesh = Mesh(scale * MUG.vertices, MUG.faces)
    spread = np.full(len(mesh.vertices), deviation)
    return SurfaceThen(f"press {number}", "words", KnownSurface(mesh, spread, np.zeros((0, 3)), ()))


@pytest.mark.parametrize("count", [1, 4, 6])
def test_each_has_a_picture_and_what_is_left_of_a_row_is_empty(count: int) -> None:
    found = [then(number, 1.0, 1e-3) for number in range(1, count + 1)]
    axes = strip_figure(found).axes
    assert len(axes) % 4 == 0
    painted = [one for one in axes if any(isinstance(part, PolyCollection) for part in one.collections)]
    assert [one.get_title(loc="left").strip() for one in painted] == [one.title for one in found]


def test_one_size_and_one_scale_hold_for_all_and_one_without_a_surface_says_why() -> None:
    nothing = SurfaceThen("press 1", "not enough", None)
    axes = strip_figure([nothing, then(2, 1.0, 4e-3), then(3, 0.5, 1e-3)]).axes
    assert "not enough" in [text.get_text() for text in axes[0].texts]
    assert axes[1].get_xlim() == axes[2].get_xlim()
    assert axes[1].get_ylim() == axes[2].get_ylim()
    colours = [np.asarray(one.collections[0].get_facecolor()) for one in axes[1:3]]
    assert colours[0].mean() < colours[1].mean()  # the less sure is the darker
