"""Strict files: every mistake is named with its key, its value and what was expected."""

import time
from pathlib import Path
from typing import Annotated, Literal

import pytest

from harness.basics.errors import WrongUse
from harness.basics.quantities import Length, Positive
from harness.basics.toml_file import StrictModel, load_toml, read_toml, validate


class Inner(StrictModel):
    depth: Annotated[Length, Positive]
    kind: Literal["foam", "clamped"] = "foam"


class Outer(StrictModel):
    title: str
    count: int = 1
    flag: bool = False
    inner: Inner
    several: tuple[Inner, ...] = ()
    maybe: Inner | None = None


GOOD = {"title": "t", "inner": {"depth": "1 mm"}}


def refusal(change: dict[str, object]) -> str:
    with pytest.raises(WrongUse) as caught:
        validate({**GOOD, **change}, Outer, "bench.toml")
    return str(caught.value)


def test_a_right_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "f.toml"
    path.write_text('title = "t"\n[inner]\ndepth = "1 mm"\n[[several]]\ndepth = "2 mm"\n', encoding="utf-8")
    read = load_toml(path, Outer)
    assert read.inner.depth == 1e-3
    assert read.several[0].depth == 2e-3


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"titel": "x"}, ["bench.toml", "'titel'", "did you mean 'title'"]),
        ({"inner": {"depth": "1 mm", "dept": 1}}, ["'inner.dept'", "in [inner]", "did you mean 'depth'"]),
        ({"several": [{"depth": "1 mm", "knd": "x"}]}, ["'several[0].knd'", "did you mean 'kind'"]),
        ({"maybe": {"depth": "1 mm", "zzz": 1}}, ["'maybe.zzz'", "depth, kind"]),
        ({"inner": {"depth": 1.5}}, ["'inner.depth'", "1.5 has no unit", '"1.2 mm"']),
        ({"inner": {"depth": "5 kg"}}, ["'inner.depth'", "'5 kg' is not a length", "mm"]),
        ({"inner": {"depth": "-1 mm"}}, ["'inner.depth' = '-1 mm'", "above zero"]),
        ({"inner": {"depth": "1 mm", "kind": "foma"}}, ["'inner.kind' = 'foma'", "did you mean 'foam'"]),
        ({"inner": {}}, ["'inner.depth' is missing"]),
        ({"inner": "x"}, ["'inner' must be a table", "'x'"]),
        ({"count": "3"}, ["'count' = '3'", "integer"]),
        ({"flag": 1}, ["'flag' = 1", "boolean"]),
    ],
)
def test_a_mistake_is_named_in_one_sentence(change: dict[str, object], parts: list[str]) -> None:
    message = refusal(change)
    assert "\n" not in message
    for part in parts:
        assert part in message


def test_several_mistakes_are_all_listed() -> None:
    message = refusal({"inner": {"depth": 3, "kind": "x"}, "cuont": 2})
    assert "3 mistakes" in message
    assert message.count("\n") == 3


def test_toml_that_does_not_parse_says_where(tmp_path: Path) -> None:
    path = tmp_path / "f.toml"
    path.write_text('title = "t"\n[inner\n', encoding="utf-8")
    with pytest.raises(WrongUse, match=r"f\.toml .*line 2"):
        load_toml(path, Outer)


def test_a_file_that_is_absent_or_not_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"none\.toml .*no such file"):
        load_toml(tmp_path / "none.toml", Outer)
    (tmp_path / "b.toml").write_bytes(b"title = \xff")
    with pytest.raises(WrongUse, match="UTF-8"):
        load_toml(tmp_path / "b.toml", Outer)


def test_json_written_reads_back_to_the_same_model() -> None:
    read = validate({**GOOD, "inner": {"depth": "1.7 mm"}}, Outer, "x")
    assert validate(read.model_dump(mode="json"), Outer, "x") == read


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-32"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_file_of_any_encoding_and_line_end_is_read(encoding: str, end: str, tmp_path: Path) -> None:
    text = 'title = "t"\n[inner]\ndepth = "1 mm"\n'
    (tmp_path / "f.toml").write_bytes(text.replace("\n", end).encode(encoding))
    assert load_toml(tmp_path / "f.toml", Outer).inner.depth == 1e-3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a." * 400_000 + "a = 1", "32 deep"),
        ('"a"."' * 200_000, "32 deep"),
        ("a = " + "[" * 500_000, "32 deep"),
        ("a = 0x" + "1" * 900_000, "64 bits"),
        ("a = " + "1" * 900_000, "4300 digits"),
        ("[[a]]\n" * 150_000, "10,000 values"),
    ],
)
def test_a_hostile_file_is_refused_in_a_sentence_and_at_once(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "f.toml").write_text(text)
    begun = time.process_time()
    with pytest.raises(WrongUse, match=said) as caught:
        load_toml(tmp_path / "f.toml", Outer)
    assert len(str(caught.value)) < 300
    assert time.process_time() - begun < 5.0


def test_dots_in_comments_and_lists_are_no_deep_key(tmp_path: Path) -> None:
    (tmp_path / "f.toml").write_text(
        f'# {"v1.2 " * 50}\n# {"." * 80}\ntitle = "to be continued{"." * 40}"\na = [{"0.1, " * 40}]\n'
    )
    assert len(read_toml(tmp_path / "f.toml")["a"]) == 40
