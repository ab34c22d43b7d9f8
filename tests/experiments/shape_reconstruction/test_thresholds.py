"""The table of thresholds: each row has a unit and a reason, and is used where its section says."""

import re
from pathlib import Path

from experiments.shape_reconstruction import thresholds

TABLE = Path(str(thresholds.__file__))
ROW = re.compile(r"^([A-Z_0-9]+) = .+  # ([^:]+): (.+)$")


def test_every_row_has_a_unit_and_a_reason_and_every_section_names_its_users() -> None:
    used: dict[str, set[str]] = {}
    for path in TABLE.parent.rglob("*.py"):
        name = path.relative_to(TABLE.parent).with_suffix("").as_posix()
        for constant in re.findall(r"\blimits\.(\w+)", path.read_text()):
            used.setdefault(constant, set()).add(name)
    stated = set()
    for section in TABLE.read_text().split("\n\n# ")[1:]:
        head, *rows = section.strip().split("\n")
        names = {row[1] for row in map(ROW.match, rows) if row}
        assert len(names) == len(rows), f"a row of {head} is not: NAME = value  # unit: reason"
        assert set(re.split(r",\s*", head.split(": ")[1])) == set().union(*(used[name] for name in names))
        stated |= names
    assert stated == {name for name in vars(thresholds) if name.isupper()} == set(used)
