r"""Train the paper's own networks, for rows of the tables beside ours. None of them ships.

\b
    python -m experiments.paper.train scale --to FOLDER
    python -m experiments.paper.train shape --to FOLDER

``scale``: ResNet-18 on a picture and on a spectrogram, a recurrent network on imprints, on the shapes that
the shipped networks learn from (``tables scale-estimation --set paper_networks=FOLDER``). ``shape``: point
completion in its published size by touch, by a picture and by both (``tables shape-reconstruction --set
pcn=FOLDER``). The latter wants a graphics processor: there seven minutes, without one days.
"""

import argparse
import sys
from functools import partial
from types import MappingProxyType

from experiments.paper.scale_networks import SIZE_INPUTS, SizeAmounts
from experiments.paper.shape_network import INPUTS as COMPLETION_INPUTS
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
from harness.basics.errors import WrongUse

SIZE_AMOUNTS = MappingProxyType(
    {
        "paper": SizeAmounts(
            520,
            MappingProxyType({"picture": 8, "spectrogram": 4, "imprints": 16}),
            MappingProxyType({"picture": 6, "spectrogram": 3, "imprints": 40}),
        ),
        "paper-smoke": SizeAmounts(
            26,
            MappingProxyType({"picture": 2, "spectrogram": 2, "imprints": 4}),
            MappingProxyType({"picture": 1, "spectrogram": 1, "imprints": 2}),
        ),
    }
)
"""As published, and one that shows in a minute that all of it runs."""

COMPLETION_AMOUNTS = MappingProxyType(
    {"paper-smoke": CompletionProfile(26, 1, 2, 4), "paper": CompletionProfile(2600, 8, 6000, 32, 4096)}
)


def main(arguments: list[str] | None = None) -> int:
    """Make the samples, fit, print the errors on held-out shapes, write."""
    parser = training_parser(str(__doc__), "paper")
    parser.add_argument("of", choices=("scale", "shape"), help="which table's networks")
    parser.add_argument("--device", choices=DEVICES, default="auto", help="device that fits completion")
    return exit_code(partial(_train, parser.parse_args(arguments)))


def _train(options: argparse.Namespace) -> None:
    if options.to is None:
        raise WrongUse("none of the paper's networks ships: add --to FOLDER")
    scale = options.of == "scale"
    sizes = find_profile(SIZE_AMOUNTS, options.profile, "the paper's networks")
    names = chosen_networks(options.only, tuple(SIZE_INPUTS if scale else COMPLETION_INPUTS))
    require_torch()
    device = device_of(options.device)
    # Both need torch.
    if scale:
        from experiments.paper.scale_training import train_paper_network

        train = partial(train_paper_network, amounts=sizes)
    else:
        from experiments.paper.shape_training import train_paper_completion

        amounts = COMPLETION_AMOUNTS[options.profile]
        train = partial(train_paper_completion, amounts=amounts, device=device)
    for name in names:
        one = partial(train, name, seed=options.seed, processes=options.processes)
        write_network(name, one, options.to, options.profile)


if __name__ == "__main__":
    sys.exit(main())
