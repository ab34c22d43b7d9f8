"""What a network of sound costs and is worth, beside what needs no training.

``PYTHONPATH=. python tests/benchmarks/sound/bench_audionet.py [object ...]`` prints, for each profile,
process seconds on one core, size, microseconds for a point, and errors on vertices that were held out.
The profiles ``small`` and ``paper`` train for minutes; name them with ``--profile``.
"""

import argparse
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from harness.authoring.audio.audio import author_audio
from harness.authoring.audio.data import canonical
from harness.authoring.audio.profiles import profile
from harness.basics.materials import material
from harness.basics.store import Store, default_folder
from harness.objects.household import MATERIALS, build
from harness.sim.modal.modal import HEARING, modes_of
from harness.sim.modal.modes import dampings
from tests.samples.network_worth import HEADINGS, said, worth


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("objects", nargs="*", default=list(MATERIALS))
    parser.add_argument("--profile", action="append")
    parser.add_argument("--modes", type=int, default=128)
    asked = parser.parse_args()
    table = Table(
        "object",
        "shapes from",
        "s",
        *HEADINGS,
        title=f"up to {asked.modes} modes below {HEARING / 1e3:g} kHz, one thread",
    )
    for name in asked.objects:
        _measure(table, name, asked.profile or ["smoke", "standard"], asked.modes)
    Console(width=140).print(table)


def _measure(table: Table, name: str, profiles: list[str], most: int) -> None:
    of = material(MATERIALS[name])
    modes = canonical(modes_of(build(name), of, most=most, store=Store(default_folder())))
    rates = dampings(modes.frequencies, of)
    for number, wanted in enumerate(profiles):
        with tempfile.TemporaryDirectory() as folder:
            begun = time.process_time()
            made = author_audio(modes, rates, profile(wanted), 0, Path(folder), lambda _doing, _share: None)
            took = time.process_time() - begun
        rows = {wanted: made.errors["network"]}
        if number == 0:
            rows |= {row: errors for row, errors in made.errors.items() if row != "network"}
        for row, errors in rows.items():
            spent = f"{took:.1f}" * (row == wanted)
            table.add_row(f"{name}, {len(modes.frequencies)}", row, spent, *said(worth(errors)))


if __name__ == "__main__":
    main()
