"""Train all that answers for objects never drawn: ``python -m experiments.scale_estimation.unseen.train``.

Shapes are split, not samples: what is held out is of shapes that nothing was fitted to. The errors there are
printed and written on the cards, and the width of the answers is made to hold there. Sound and touch need
torch: ``pip install '.[author]'``. Modes that were solved are kept, so that a run that was stopped goes on.
"""

import argparse
import json
import sys
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

from experiments.scale_estimation.unseen.training.outlines import train_outlines
from experiments.scale_estimation.unseen.training.real_shapes import train_real_shapes
from harness.basics.cores import own_cores

NETWORKS = ("sound", "touch", "imprints")
SENSES = ("outline", *NETWORKS, "real-shapes")


@dataclass(frozen=True)
class Profile:
    """How much is made and for how long it is learnt.

    Attributes:
        outlines: shapes whose outlines are fitted.
        shapes: whose strikes and contacts are learnt.
        strikes: samples of strikes of each.
        contacts: explorations of each.
        epochs: of sound, of touch and imprints.
        members: networks of each sense.
    """

    outlines: int
    shapes: int
    strikes: int
    contacts: int
    epochs: tuple[int, int]
    members: int = 3


PROFILES = MappingProxyType(
    {
        "smoke": Profile(260, 26, 4, 8, (2, 2)),
        "standard": Profile(1300, 520, 40, 48, (30, 60)),
    }
)


def main(arguments: list[str] | None = None) -> int:
    """Make the samples, fit, say what is reached on shapes that were held out, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--profile", choices=list(PROFILES), default="standard")
    parser.add_argument("--only", choices=SENSES, action="append", help="again for more than one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=own_cores(), help="that make samples")
    parser.add_argument("--meshes", type=Path, help="folder of scanned things, for real-shapes")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "data", help="a folder")
    options = parser.parse_args(arguments)
    senses, profile = options.only or SENSES, PROFILES[options.profile]
    if find_spec("torch") is None and set(NETWORKS) & set(senses):
        sys.stderr.write("networks need torch: pip install '.[author]', or say --only outline\n")
        return 2
    options.out.mkdir(parents=True, exist_ok=True)
    if "outline" in senses:
        sys.stdout.write(train_outlines(profile.outlines, options.seed, options.out) + "\n")
    for sense in [sense for sense in NETWORKS if sense in senses]:
        from experiments.scale_estimation.unseen.training.train_network import train_network  # needs torch

        began = time.perf_counter()
        data, card = train_network(sense, profile, options.seed, options.processes)
        card["profile"], card["seconds"] = options.profile, round(time.perf_counter() - began, 1)
        (options.out / f"{sense}.onnx").write_bytes(data)
        (options.out / f"{sense}.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
        reached = {name: card[name] for name in ("held_out", "seconds")}
        sys.stdout.write(f"{sense}: {json.dumps(reached)}\n")
    if "real-shapes" in senses and options.meshes is not None:
        widths = train_real_shapes(options.meshes, options.seed)
        (options.out / "real_shapes.json").write_text(json.dumps(widths, indent=1) + "\n", encoding="utf-8")
        sys.stdout.write(f"real shapes: {json.dumps(widths)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
