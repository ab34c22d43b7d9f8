"""The answers of a cost curve are timed without garbage collection."""

import gc
from collections.abc import Iterator

import pytest

from harness.experiment.costing import _uncollected


@pytest.fixture
def collector() -> Iterator[None]:
    yield
    gc.enable()


@pytest.mark.usefixtures("collector")
@pytest.mark.parametrize("before", [True, False])
def test_the_collector_is_left_as_it_was(before: bool) -> None:
    (gc.enable if before else gc.disable)()
    with _uncollected():
        assert not gc.isenabled()
    assert gc.isenabled() == before
