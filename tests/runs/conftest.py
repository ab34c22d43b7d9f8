"""One run on the bench in process, made once and copied by the tests that change it."""

from collections.abc import Iterator

import pytest

from harness.recording.recording import Recording
from harness.report.figures import shading
from tests.support.whole_run import in_process_run, touch_scene


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Three spread contacts on the mug, with the default gap; nothing may be changed in its folder."""
    return in_process_run(tmp_path_factory.mktemp("run") / "mug", touch_scene(), seed=3)


@pytest.fixture(scope="module", autouse=True)
def _coarse_pictures() -> Iterator[None]:
    """Shade the pictures of reports at one sample per pixel: no test here is about their edges."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(shading, "_OVERSAMPLING", 1)
        yield
