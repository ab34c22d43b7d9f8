"""The ObjectFiles that come with the program: ours, whole, small, and what their cards say."""

import pytest

from harness.basics.materials import MATERIALS
from harness.bench.scene import scene_from_options
from harness.bench.scene_objectfile import shipped_objectfiles
from harness.effects.scene_object import known_file, known_object
from harness.objectfile.file import ObjectFile
from harness.objectfile.verify import verify
from harness.objects import household

MOST_BYTES = 40_000_000
"""Of all of them: they lie in the repository."""

LEAST_DECIBELS = {"touch": 38.0, "vision": 36.0}
"""Of a map of 2 mm at places never coded, in the median; of held-out pictures, in the mean."""

NAMES = tuple(household.MATERIALS)


def opened(name: str) -> ObjectFile:
    return ObjectFile.open(shipped_objectfiles()[name])


def test_all_of_ours_are_there_within_the_bytes_of_a_repository() -> None:
    assert set(NAMES) <= shipped_objectfiles().keys()
    files = [path for name in NAMES for path in shipped_objectfiles()[name].iterdir()]
    assert sum(path.stat().st_size for path in files) <= MOST_BYTES


@pytest.mark.parametrize("name", NAMES)
def test_each_is_of_the_built_in_object_with_every_sense(name: str) -> None:
    of, scene = opened(name), scene_from_options(name)
    assert scene.object.name == of.description.name == name
    assert of.material == MATERIALS[household.MATERIALS[name]]
    mesh = known_object(scene_from_options(f"builtin:{name}")).mesh
    assert known_file(scene, mesh) is not None
    assert of.description.networks.keys() == {"audio", "touch", "vision"}


@pytest.mark.parametrize("name", NAMES)
def test_each_says_errors_that_are_worth_shipping(name: str) -> None:
    networks = opened(name).description.networks
    assert networks["audio"].measured["gain_error_median"] <= 0.03
    assert networks["touch"].measured["unseen_places_psnr_db_median"] >= LEAST_DECIBELS["touch"]
    assert networks["vision"].measured["psnr_db"] >= LEAST_DECIBELS["vision"]


@pytest.mark.parametrize("name", ["wrench", pytest.param("mug", marks=pytest.mark.slow)])
def test_it_is_what_it_says(name: str) -> None:
    assert [check.said for check in verify(opened(name)) if not check.passed] == []
