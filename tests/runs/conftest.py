"""One run on the bench in process, made once and copied by the tests that change it."""

import pytest

from harness.recording.recording import Recording
from tests.support.whole_run import in_process_run, touch_scene


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Three spread contacts on the mug, with the default gap; nothing may be changed in its folder."""
    return in_process_run(tmp_path_factory.mktemp("run") / "mug", touch_scene(), seed=3)
