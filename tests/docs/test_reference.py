"""docs/reference says what the code says: `make reference` would change no page."""

from pathlib import Path
from typing import Any

import pytest

from harness.effects.accuracy import Accuracy
from harness.experiment.answer import finish
from harness.experiment.lookup import find_experiment
from harness.recording.run_folder import RunFiles
from tests.docs.reference import FOLDER, pages
from tests.docs.result_keys import ASKED, COMMON, ESTIMATE, LOCALIZATION
from tests.support.whole_run import in_process_run, touch_scene

PAGES = pages()


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_as_it_is_generated(name: str) -> None:
    assert (FOLDER / name).read_text(encoding="utf-8") == PAGES[name], "run `make reference`"


def test_there_is_no_other_page() -> None:
    assert {path.name for path in FOLDER.iterdir()} == set(PAGES)


def test_a_result_has_the_keys_that_the_page_lists(tmp_path: Path) -> None:
    recording = in_process_run(tmp_path / "run", touch_scene(contacts=1), seed=3)
    experiment = find_experiment("contact-localization")

    def page(*_: Any) -> Path:
        return tmp_path / "page.html"

    found = finish(experiment, RunFiles(recording), Accuracy.default(experiment.knobs), page)
    assert set(found) == {*COMMON, *LOCALIZATION}
    assert not set(found) & set(ASKED)
    (estimate,) = found["estimates"].values()
    assert set(estimate) == set(ESTIMATE)
