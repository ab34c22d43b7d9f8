"""Shadow tables out of files: the published one without running it, and a plain one."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import CalibrationRefused
from harness.sim.optics.shadow_file import SHALLOWEST, read_shadow_table

DIRECTIONS = np.linspace(0.0, 6.2, 5)
LENGTHS = np.arange(3 * 5 * 2).reshape(3, 5, 2) % 4


def as_published(kind: Any = np.float64) -> Any:
    """Lists of numbers by channel, blue first; each number says where it stands."""
    table = np.empty(LENGTHS.shape, dtype=object)
    for c, d, k in np.ndindex(LENGTHS.shape):
        table[c, d, k] = [kind(-(100 * c + 10 * d + k) - 0.125 * s) for s in range(LENGTHS[c, d, k])]
    return table


def whole(level: float) -> int:
    return round(abs(level))


def samples(table: Any, c: int, d: int, k: int) -> list[float]:
    starts = np.concatenate([[0], np.cumsum(table.lengths.ravel())])
    at = (c * table.lengths.shape[1] + d) * table.lengths.shape[2] + k
    return [float(value) for value in table.values[starts[at] : starts[at + 1]]]


@pytest.mark.parametrize("kind", [np.float64, float])
def test_every_list_is_read_in_its_place_and_turned_to_rgb(tmp_path: Path, kind: Any) -> None:
    lists = as_published(kind)
    np.savez(tmp_path / "shadowTable.npz", shadowDirections=DIRECTIONS, shadowTable=lists)
    table = read_shadow_table(tmp_path / "shadowTable.npz")
    assert table.shallowest == SHALLOWEST
    assert np.array_equal(table.directions, DIRECTIONS)
    for c, d, k in np.ndindex(LENGTHS.shape):
        assert samples(table, 2 - c, d, k) == lists[c, d, k]


def test_a_number_that_stands_twice_is_read_twice(tmp_path: Path) -> None:
    level = np.float64(-3.5)
    lists = as_published()
    lists[2, 1, 1] = [level, np.float64(-1.0), level, level]
    np.savez(tmp_path / "a.npz", shadowDirections=DIRECTIONS, shadowTable=lists)
    assert samples(read_shadow_table(tmp_path / "a.npz"), 0, 1, 1) == [-3.5, -1.0, -3.5, -3.5]


def test_a_plain_file_says_the_same(tmp_path: Path) -> None:
    lists = as_published()
    np.savez(tmp_path / "a.npz", shadowDirections=DIRECTIONS, shadowTable=lists)
    values = np.concatenate([lists[at] for at in np.ndindex(LENGTHS.shape)])
    np.savez(tmp_path / "b.npz", directions=DIRECTIONS, lengths=LENGTHS, values=values)
    published, plain = (read_shadow_table(tmp_path / name) for name in ("a.npz", "b.npz"))
    assert np.array_equal(published.lengths, plain.lengths)
    assert np.array_equal(published.values, plain.values)


def test_taxims_own_table_is_read(shared_data: Path) -> None:
    lab = shared_data / "tactile/taxim/gelsight_lab"
    published = read_shadow_table(lab / "shadowTable.npz")
    assert published.lengths.shape == (3, 63, 9)
    if not (lab / "shadowTable_plain.npz").exists():
        pytest.skip("shadowTable_plain.npz is absent: `make data` does not fetch converted files")
    plain = read_shadow_table(lab / "shadowTable_plain.npz")
    assert np.array_equal(published.lengths, plain.lengths)
    assert np.abs(published.values - plain.values).max() < 1e-5  # the plain one is in single precision


class Trap:
    """What a hostile file would have run."""

    sprung = False

    def __reduce__(self) -> Any:
        return spring, ()


def spring() -> float:
    Trap.sprung = True
    return -1.0


def test_nothing_in_a_file_is_run(tmp_path: Path) -> None:
    lists = as_published()
    lists[1, 2, 1] = [Trap()]
    np.savez(tmp_path / "a.npz", shadowDirections=DIRECTIONS, shadowTable=lists)
    with pytest.raises(CalibrationRefused, match=r"shadowTable\.npy .*float64"):
        read_shadow_table(tmp_path / "a.npz")
    assert not Trap.sprung


def test_what_is_no_shadow_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    with pytest.raises(CalibrationRefused, match=r"a\.npz .*no such file"):
        read_shadow_table(path)
    path.write_bytes(b"not an archive")
    with pytest.raises(CalibrationRefused, match=r"a\.npz .*(damaged|archive)"):
        read_shadow_table(path)
    cases: list[tuple[str, dict[str, Any]]] = [
        ("holds", {"directions": DIRECTIONS}),
        ("3 channels", {"shadowDirections": DIRECTIONS[:4], "shadowTable": as_published()}),
        ("lists in the order", {"shadowDirections": DIRECTIONS, "shadowTable": LENGTHS}),
        ("f4", {"shadowDirections": DIRECTIONS, "shadowTable": as_published(np.float32)}),
        ("float64", {"shadowDirections": DIRECTIONS, "shadowTable": as_published(whole)}),
        ("samples", {"directions": DIRECTIONS, "lengths": LENGTHS, "values": np.zeros(7)}),
    ]
    for words, arrays in cases:
        np.savez(path, **arrays)
        with pytest.raises(CalibrationRefused, match=words):
            read_shadow_table(path)
