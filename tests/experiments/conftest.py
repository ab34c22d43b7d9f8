"""Reports in tests of experiments: no test here is about the resolution of their pictures."""

from collections.abc import Iterator

import pytest

from harness.report.figures import shading


@pytest.fixture(scope="session", autouse=True)
def _coarse_pictures() -> Iterator[None]:
    """Shade the pictures of reports at one sample per pixel."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(shading, "_OVERSAMPLING", 1)
        yield
