"""Command ``touchstone init``: write the folder of a project, with files to start from."""

from pathlib import Path
from typing import Annotated

import typer

from harness.basics.errors import WrongUse
from harness.bench.named_files import SHIPPED
from harness.commands import options
from harness.commands.output import ANSWERS, emit

_COPIES = {
    "stations/bench.toml": "stations/mock.toml",
    "stations/real_bench.toml": "stations/example_bench.toml",
    "scenes/mug.toml": "scenes/mug_touch.toml",
}
"""Shipped file by the file of the project that starts as its copy."""

_README = """\
# A Touchstone project

| file | content |
|---|---|
| `stations/bench.toml` | a mocked bench: programs stand for the instruments |
| `stations/real_bench.toml` | a real bench to fill in: addresses, serial numbers, limits, frames |
| `scenes/mug.toml` | an object and its pose, the senses to use, and the settings of the experiment |

In this folder:

    touchstone run contact-localization --station bench --scene mug
    touchstone explain scenes/mug.toml
    touchstone check --station bench

Runs are written to `runs/`, each with its recording, `result.json` and `report/report.html`;
`touchstone replay RUN` answers one again without a bench. Stations, scenes and ObjectFiles are found by
name in `stations/`, `scenes/` and `objects/` of this folder first, then among those that come with the
program. `touchstone object build` makes the ObjectFile of your own object.
"""


def init(
    folder: Annotated[
        Path, typer.Argument(help="A new folder, or one without these files.", metavar="FOLDER")
    ],
    json: options.Json = False,
) -> int:
    """Write a station, a scene and a README to start a project from.

    The station bench is mocked, so that everything can be tried at once; real_bench is to be filled in.

    Try: touchstone init my-lab
    """
    from harness.basics.whole_file import write_text_whole

    texts = {name: (SHIPPED / source).read_text(encoding="utf-8") for name, source in _COPIES.items()}
    texts["README.md"] = _README
    there = [name for name in texts if (folder / name).exists()]
    if there:
        raise WrongUse(f"{folder} already has {', '.join(there)}; give another folder, or move these away")
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_text_whole(folder / name, text)
    if json:
        emit({"schema": 1, "folder": str(folder), "files": list(texts)})
    else:
        ANSWERS.print(f"{folder}: {', '.join(texts)}", markup=False)
        ANSWERS.print(
            f"next: cd {folder}; touchstone run contact-localization --station bench --scene mug",
            markup=False,
        )
    return 0
