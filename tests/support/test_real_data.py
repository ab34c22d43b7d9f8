"""The real data is found wherever it is there to be found."""

import pytest

from tests.support.real_data import BESIDE, WHY_NOT, find_shared_data


def test_data_beside_the_checkout_is_found() -> None:
    if not BESIDE.exists():
        pytest.skip(WHY_NOT)
    assert find_shared_data() is not None, f"{BESIDE} exists but no MANIFEST.md was found in it"
