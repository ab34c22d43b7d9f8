"""Profiles are what they are named for, and what makes no sense is refused."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.authoring.vision.layers import (
    first_weights,
    parameter_count,
)
from harness.authoring.vision.profiles import VisionProfile, vision_profile
from harness.authoring.vision.vision import author_vision
from harness.basics.errors import WrongUse
from harness.objectfile.vision.network import COMPACT, PAPER
from harness.sim.light.direct_image import LitObject
from tests.samples.taught_ball import SIZE, TINY, lit_ball


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


def test_profiles_are_as_large_as_they_are_named() -> None:
    compact, paper = vision_profile("standard"), vision_profile("paper")
    assert replace(paper.networks.size, kind="osf") == PAPER
    assert replace(compact.networks.size, kind="osf") == COMPACT
    assert PAPER.parameters == 20_292


@pytest.mark.slow  # of the longest training alone
def test_networks_of_the_papers_size_learn_too(lit: LitObject, tmp_path: Path) -> None:
    """Ten octaves, of which the highest turn 160 times in a cell, do not spoil what lies between places."""
    wide = replace(vision_profile("paper").networks, cells=4, places=6000, steps=100, batch=64)
    profile = VisionProfile(wide, pictures=2, side=48, samples=3)
    errors = {}
    for name, size in (("paper", wide.size), ("compact", vision_profile("standard").networks.size)):
        chosen = replace(profile, networks=replace(wide, size=size))
        folder = tmp_path / name
        folder.mkdir()
        errors[name] = author_vision(lit.appearance, chosen, 0, folder, lambda *_: None, threads=1).errors
    # Nearly as good as of six octaves, on a ball of one colour that needs none of them.
    assert errors["paper"]["psnr_db"] > errors["compact"]["psnr_db"] - 1.0
    assert errors["paper"]["bytes"] > 2.0 * errors["compact"]["bytes"]


def test_what_cannot_be_trained_says_so(lit: LitObject, tmp_path: Path) -> None:
    for wrong in ({"places": 0}, {"overlap": 0.7}, {"hidden": 1.5}, {"rate": 0.0}):
        with pytest.raises(WrongUse, match="give"):
            replace(TINY, **wrong)
    with pytest.raises(WrongUse, match="'smok'"):
        vision_profile("smok")
    assert parameter_count(SIZE) == len(first_weights(SIZE, 0))
