"""Mocks answer on this computer only."""

import ipaddress

from harness.basics.errors import WrongUse


def require_own_address(host: str) -> str:
    """``host``, which no other computer can reach.

    Raises:
        WrongUse: it is not a loopback address.
    """
    try:
        own = ipaddress.ip_address(host).is_loopback
    except ValueError:
        own = False
    if not own:
        raise WrongUse(
            f"a mock was asked to serve on '{host}'; it serves on loopback addresses only (127.0.0.0/8), "
            "for it obeys whoever connects: take 127.0.0.2"
        )
    return host
