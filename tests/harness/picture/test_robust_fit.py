"""Few numbers from many points: exact where points are, moved as they move, deaf to outliers."""

import numpy as np
import pytest

from harness.picture.exposure_fit import robust_fit, scatter

RANDOM = np.random.default_rng(0)
X = RANDOM.uniform(0.0, 1.0, 600)
LINE = np.column_stack([X, np.ones_like(X)])
BLOCKS = np.arange(600) // 20


def test_points_on_a_line_give_it() -> None:
    found = robust_fit(LINE, LINE @ [0.7, 0.1], BLOCKS, 30, 1e-6)
    assert found is not None
    np.testing.assert_allclose(found.values, [0.7, 0.1], atol=1e-9)
    assert (found.outliers, found.scale) == (0.0, 1e-6)


def test_a_line_added_to_all_points_is_added_to_the_answer() -> None:
    wanted = LINE @ [0.7, 0.1] + RANDOM.standard_t(2, 600) * 0.02
    one, other = (robust_fit(LINE, each, BLOCKS, 30, 1e-6) for each in (wanted, wanted + LINE @ [3.0, -1.0]))
    assert one is not None
    assert other is not None
    np.testing.assert_allclose(other.values - one.values, [3.0, -1.0], atol=1e-6)
    np.testing.assert_allclose(other.moved, one.moved, atol=1e-6)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.4])
def test_two_fifths_of_wrong_points_change_little(share: float) -> None:
    wanted = LINE @ [0.7, 0.1] + RANDOM.normal(0.0, 0.01, 600)
    wanted[: int(share * 600)] = 5.0
    found = robust_fit(LINE, wanted, BLOCKS, 30, 1e-6)
    assert found is not None
    assert found.outliers == pytest.approx(share, abs=0.01)
    np.testing.assert_allclose(found.values, [0.7, 0.1], atol=0.01)


def test_points_that_err_together_are_as_few_as_their_blocks() -> None:
    """A mean of 30 blocks of 20 equal points errs as that of 30 points, not as of 600."""
    together = np.repeat(RANDOM.normal(size=30), 20)
    ones = np.ones((600, 1))
    errors = []
    for wanted in (together, RANDOM.permutation(together)):
        found = robust_fit(ones, wanted, BLOCKS, 30, 1e-6)
        assert found is not None
        errors.append(float(np.sqrt((found.moved**2).sum())))
    assert errors[0] == pytest.approx(together.std() / np.sqrt(30.0), rel=0.25)
    assert errors[0] / errors[1] == pytest.approx(np.sqrt(20.0), rel=0.35)


def test_the_scatter_of_normal_numbers_is_their_deviation() -> None:
    assert scatter(RANDOM.normal(0.0, 3.0, 20000)) == pytest.approx(3.0, rel=0.03)
