r"""Train the network of the glance on random household shapes; no test object is among them.

\b
    python -m experiments.shape_reconstruction.prior.train --profile long

The network that ships has learnt from this profile: 6 minutes on a GPU. The networks of ObjectFolder 2.0
beside it in the table are trained by ``python -m experiments.paper.train shape --to FOLDER``.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from types import MappingProxyType

from experiments.shape_reconstruction.prior.samples import CompletionProfile
from harness.authoring.network_program import (
    DEVICES,
    chosen_networks,
    device_of,
    exit_code,
    require_torch,
    training_parser,
    write_network,
)
from harness.authoring.profiles import find_profile

PROFILES = MappingProxyType(
    {
        "smoke": CompletionProfile(26, 2, 4),
        "standard": CompletionProfile(2000, 6, 3000, 24, 512),
        "long": CompletionProfile(12000, 6, 24000, 96, 768),
    }
)


def main(arguments: list[str] | None = None) -> int:
    """Make the samples, fit, print the errors on held-out shapes, write."""
    parser = training_parser(str(__doc__), "standard")
    parser.add_argument("--device", choices=DEVICES, default="auto", help="device of the fit")
    return exit_code(partial(_train, parser.parse_args(arguments)))


def _train(options: argparse.Namespace) -> None:
    paper = "; the paper's networks: python -m experiments.paper.train shape --to FOLDER"
    amounts = find_profile(PROFILES, options.profile, "the glance", advice=paper)
    chosen_networks(options.only, ("glance",))
    require_torch()
    device = device_of(options.device)
    from experiments.shape_reconstruction.prior.training import train_prior  # needs torch

    train = partial(train_prior, amounts, options.seed, options.processes, device)
    write_network("glance", train, options.to or Path(__file__).parent / "data", options.profile)


if __name__ == "__main__":
    sys.exit(main())
