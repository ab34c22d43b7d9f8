"""What every part of an object says of where it came from, and what the parts are asked with."""

import importlib
from dataclasses import fields
from typing import Literal

import pytest

from harness.authoring.audio.object_audio import AudioRequest
from harness.authoring.object_source import PartRequest, provenance_of
from harness.authoring.touch.object_touch import TouchRequest
from harness.basics.code_version import closure, content_hash
from harness.basics.materials import MATERIALS
from harness.objectfile.entries import Provenance, Source

WANTED = PartRequest("block.ply", MATERIALS["wood"], "smoke", "mm", 2e-3, "CC-BY-4.0", 7)
SOURCE = Source(what="mesh", origin="block.ply", licence="CC-BY-4.0", sha256="0" * 64)


@pytest.mark.parametrize("part", ["audio", "touch", "vision"])
def test_a_part_says_the_code_that_builds_it_its_seed_and_what_it_is_of(
    part: Literal["audio", "touch", "vision"],
) -> None:
    made = provenance_of(WANTED, part, {"steps": 60, "width": None}, (SOURCE,))
    builder = f"harness.authoring.{part}.object_{part}"
    assert callable(getattr(importlib.import_module(builder), f"build_{part}"))
    assert made.code == {builder: content_hash(builder)}
    assert "harness.authoring.object_source" in closure(builder)
    assert (made.seeds, made.sources, made.licence) == ({part: 7}, (SOURCE,), "CC-BY-4.0")
    assert list(made.settings.items()) == [("profile", "smoke"), ("steps", 60), ("width", None)]
    assert Provenance.model_validate_json(made.model_dump_json()) == made


@pytest.mark.parametrize("request_of", [AudioRequest, TouchRequest])
def test_sound_and_touch_ask_what_every_part_asks_and_in_its_order(request_of: type[PartRequest]) -> None:
    shared = [field.name for field in fields(PartRequest)]
    assert [field.name for field in fields(request_of)][: len(shared)] == shared
    asked = request_of(**vars(WANTED))
    assert all(getattr(asked, name) == getattr(WANTED, name) for name in shared)
