"""Find the profile of a sense by its name."""

from collections.abc import Collection, Mapping
from typing import TypeVar

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest

Profile = TypeVar("Profile")


def find_profile(
    profiles: Mapping[str, Profile], name: str, sense: str, removed: Collection[str] = (), advice: str = ""
) -> Profile:
    """Return the profile of that name.

    ``removed`` profiles of earlier versions are replaced by ``standard``; ``advice`` ends a refusal.

    Raises:
        WrongUse: there is none.
    """
    if name in profiles:
        return profiles[name]
    if name in removed:
        raise WrongUse(f"{sense} no longer has the profile {name!r}; take standard, which needs no torch")
    raise WrongUse(f"no profile {name!r} of {sense}; {nearest(name, profiles)}{advice}")
