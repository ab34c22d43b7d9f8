"""Train all that answers for objects never drawn: ``python -m experiments.scale_estimation.unseen.train``.

Shapes are split, not samples: what is held out is of shapes that nothing was fitted to. The errors there are
printed and written on the cards, and the width of the answers is made to hold there. Sound and touch need
torch: ``pip install '.[author]'``. Modes that were solved are kept, so that a run that was stopped goes on.
"""

import argparse
import json
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

from experiments.scale_estimation.unseen.training.outlines import train_outlines
from experiments.scale_estimation.unseen.training.real_shapes import train_real_shapes
from harness.authoring.network_program import (
    chosen_networks,
    exit_code,
    require_torch,
    training_parser,
    write_network,
)
from harness.authoring.profiles import find_profile

NETWORKS = ("sound", "touch", "imprints")
REAL_SHAPES = "real-shapes"
SENSES = ("outline", *NETWORKS, REAL_SHAPES)


@dataclass(frozen=True)
class Profile:
    """How much is made and for how long it is learnt."""

    outlines: int  #: shapes whose outlines are fitted.
    shapes: int  #: whose strikes and contacts are learnt.
    strikes: int  #: samples of strikes of each.
    contacts: int  #: explorations of each.
    epochs: tuple[int, int]  #: of sound, of touch and imprints.
    members: int = 3  #: networks of each sense.


PROFILES = MappingProxyType(
    {
        "smoke": Profile(260, 26, 4, 8, (2, 2)),
        "standard": Profile(1300, 520, 40, 48, (30, 60)),
    }
)


def main(arguments: list[str] | None = None) -> int:
    """Make the samples, fit, print what is reached on shapes that were held out, write."""
    parser = training_parser(str(__doc__), "standard")
    parser.add_argument("--meshes", type=Path, help="folder of scanned things, for real-shapes")
    return exit_code(partial(_train, parser.parse_args(arguments)))


def _train(options: argparse.Namespace) -> None:
    paper = "; the paper's networks: python -m experiments.paper.train scale --to FOLDER"
    profile = find_profile(PROFILES, options.profile, "scale", advice=paper)
    senses = chosen_networks(options.only, SENSES)
    fitted = [sense for sense in senses if sense in NETWORKS]
    if fitted:
        require_torch(", or add --only outline")
    folder: Path = options.to or Path(__file__).parent / "data"
    folder.mkdir(parents=True, exist_ok=True)
    if "outline" in senses:
        sys.stdout.write(train_outlines(profile.outlines, options.seed, folder) + "\n")
    for sense in fitted:
        from experiments.scale_estimation.unseen.training.train_network import train_network  # needs torch

        train = partial(train_network, sense, profile, options.seed, options.processes)
        write_network(sense, train, folder, options.profile)
    if REAL_SHAPES not in senses:
        return
    if options.meshes is None:
        sys.stdout.write("real shapes: left out; add --meshes FOLDER of scanned things\n")
        return
    # How much wider answers about scanned things are, by the networks that came with the program.
    widths = train_real_shapes(options.meshes, options.seed)
    (folder / "real_shapes.json").write_text(json.dumps(widths, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"real shapes: {json.dumps(widths)}\n")


if __name__ == "__main__":
    sys.exit(main())
