"""The documentation site is strict: a page with a link or a name that leads nowhere does not build."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = """# Page

[a page](nowhere.md), [a heading](page.md#nowhere), $\\unknowncommand$.

```{eval-rst}
.. py:function:: press(gel: NoSuchName) -> harness.basics.mesh.Mesh

   Press.

   :raises NoSuchError: never.
```
"""


def test_links_names_and_formulas_that_lead_nowhere_fail(tmp_path: Path) -> None:
    pytest.importorskip("sphinx")
    source = tmp_path / "source"
    source.mkdir()
    (source / "page.md").write_text(PAGE)
    settings = {
        "root_doc": "page",
        "include_patterns": "page.md",
        "html_theme": "basic",
        "html_additional_pages": "",
    }
    options = [word for key, value in settings.items() for word in ("-D", f"{key}={value}")]
    build = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet", "--fresh-env"]
    ended = subprocess.run(
        [*build, *options, "-c", ROOT / "docs/site", source, tmp_path / "site"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONWARNINGS": ""},
    )
    assert ended.returncode == 1
    for word in ("nowhere.md", "'nowhere'", "unknowncommand", "NoSuchName", "NoSuchError"):
        assert word in ended.stderr, word
    assert "Mesh" not in ended.stderr
