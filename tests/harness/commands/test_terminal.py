"""Names in files cannot move the terminal's cursor, colour its text or forge its lines."""

import io
import re
from pathlib import Path

import pytest
from rich.table import Table

from harness.cli import invoke
from harness.commands.terminal import SafeConsole, escape_message

HOSTILE = "a\x1b[31m\x1b]0;title\x07\x9b1A\u202egnp\u2066\x85\x00\u2028z"
CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")


def test_texts_tables_and_bars_are_printed_without_control_characters() -> None:
    written = io.StringIO()
    console = SafeConsole(file=written, width=200)
    table = Table(title=HOSTILE)
    table.add_column(HOSTILE)
    table.add_row(HOSTILE)
    console.print(HOSTILE, markup=False)
    console.print(table)
    assert not CONTROLS.search(written.getvalue())
    assert written.getvalue().count(r"\x1b") == 8
    assert r"\u202e" in written.getvalue()


def test_colours_of_the_program_itself_stay() -> None:
    written = io.StringIO()
    SafeConsole(file=written, width=200, force_terminal=True, color_system="standard").print(
        "[red]error:[/] \\x1b \x1b[32m", markup=True
    )
    assert "\x1b[31m" in written.getvalue()
    assert "\x1b[32m" not in written.getvalue()


def test_names_between_colons_are_printed_as_they_are() -> None:
    written = io.StringIO()
    SafeConsole(file=written, width=200).print("builtin:wrench: steel :mug:")
    assert written.getvalue() == "builtin:wrench: steel :mug:\n"


def test_only_items_of_a_list_begin_a_line() -> None:
    assert escape_message("2 mistakes:\n  - a\n  - b") == "2 mistakes:\n  - a\n  - b"
    assert escape_message("a\nerror: forged\r\n") == r"a\nerror: forged\r\n"


@pytest.mark.parametrize(
    "command",
    [
        ["sim", "modes", "{mesh}", "--units", "mm", "--material", "steel"],
        ["sim", "modes", "{mesh}.missing", "--material", "steel"],
        ["explain", "{scene}"],
        ["catalogue", "check", "{rows}", "--meshes", "."],
        ["run", HOSTILE.replace("\x00", "")],
    ],
)
def test_no_command_prints_control_characters_of_names(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = HOSTILE.replace("\x00", "").replace("/", "") + "\nerror: forged"
    mesh, scene, rows = tmp_path / f"{name}.obj", tmp_path / "s.toml", tmp_path / "r.csv"
    mesh.write_text("v 1,5 \x1b[31m 2\n")
    scene.write_text(
        'schema = 1\n"a\\u001b[31m\\u202e\\nerror: forged" = "\\u001b]0;x"\n'
        '[object]\nmesh = "builtin:mug\\u001b"\n'
    )
    rows.write_text(f'name,material\n"{HOSTILE}\nerror: forged",steel\nmug,"{HOSTILE}"\n')
    words = [word.format(mesh=mesh, scene=scene, rows=rows) for word in command]
    assert invoke(words) != 0
    captured = capsys.readouterr()
    assert not CONTROLS.search(captured.out + captured.err)
    assert "\nerror: forged" not in captured.out + captured.err
