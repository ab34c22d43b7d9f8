"""Numbers beside crowded marks."""

import numpy as np
import pytest
from matplotlib.text import Text

from harness.basics.arrays import FloatArray
from harness.report.figures.charts import ErrorCurve, error_chart, number_marks
from harness.report.figures.style import blank


def boxes(marks: FloatArray) -> FloatArray:
    """``(n, 2, 2)`` pixels: where the numbers of some marks were written."""
    figure = blank(6.0, 4.0)
    axes = figure.add_subplot()
    axes.plot(*marks.T, "o")
    number_marks(figure, axes, marks, [str(k + 1) for k in range(len(marks))])
    figure.draw_without_rendering()
    assert [text.get_text() for text in axes.texts] == [str(k + 1) for k in range(len(marks))]
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]  # of the Agg canvas
    return np.array([Text.get_window_extent(text, renderer).get_points() for text in axes.texts])


@pytest.mark.parametrize("seed", range(5))
def test_numbers_of_crowded_marks_do_not_touch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    marks = np.concatenate([rng.normal(0.5, 0.015, (8, 2)), rng.uniform(0.0, 1.0, (6, 2))])
    found = boxes(marks)
    for k, one in enumerate(found):
        for other in found[k + 1 :]:
            shared = np.minimum(one[1], other[1]) - np.maximum(one[0], other[0])
            assert shared.min() <= 1.0  # pixels of a text's own margin


def test_labels_of_a_curve_are_numbered_and_explained_beside_it() -> None:
    curves = (
        ErrorCurve("a", (0.01, 0.011), (1e-3, 1e-3), ("cheap", "dear")),
        ErrorCurve("b", (0.02,), (2e-3,), ("one",)),
    )
    (axes,) = error_chart(curves, "seconds", logarithmic_x=True).axes
    said = [text.get_text() for text in axes.texts]
    assert said == ["1  cheap\n2  dear\n3  one", "1", "2", "3"]
    (plain,) = error_chart((ErrorCurve("a", (1.0, 2.0), (1e-3, 2e-3)),), "contacts", logarithmic_x=False).axes
    assert not plain.texts
