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
REAL_SHAPES = "real-shapes"
SENSES = ("outline", *NETWORKS, REAL_SHAPES)
WITHOUT_TORCH = ("outline", REAL_SHAPES)


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
    options = _parser().parse_args(arguments)
    if options.profile not in PROFILES:
        return _refused(
            f"there is no profile {options.profile}; there are {', '.join(PROFILES)}. The paper's networks "
            "are trained by python -m experiments.paper.train scale --to FOLDER"
        )
    senses = tuple(sense for sense in SENSES if not options.only or sense in options.only)
    fitted = tuple(sense for sense in senses if sense not in WITHOUT_TORCH)
    if find_spec("torch") is None and fitted:
        return _refused("networks need torch: pip install '.[author]', or add --only outline")
    folder: Path = options.to or Path(__file__).parent / "data"
    folder.mkdir(parents=True, exist_ok=True)
    if "outline" in senses:
        profile = PROFILES[options.profile]
        sys.stdout.write(train_outlines(profile.outlines, options.seed, folder) + "\n")
    for sense in fitted:
        _train(sense, options, folder)
    if REAL_SHAPES in senses:
        _widen(options, folder)
    return 0


def _widen(options: argparse.Namespace, folder: Path) -> None:
    """Write how much wider answers about scanned things are, by the networks that came with the program."""
    if options.meshes is None:
        sys.stdout.write("real shapes: left out; add --meshes FOLDER of scanned things\n")
        return
    widths = train_real_shapes(options.meshes, options.seed)
    (folder / "real_shapes.json").write_text(json.dumps(widths, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"real shapes: {json.dumps(widths)}\n")


def _train(sense: str, options: argparse.Namespace, folder: Path) -> None:
    """One network with its card, written."""
    # It needs torch.
    from experiments.scale_estimation.unseen.training.train_network import train_network

    began = time.perf_counter()
    data, card = train_network(sense, PROFILES[options.profile], options.seed, options.processes)
    card["profile"], card["seconds"] = options.profile, round(time.perf_counter() - began, 1)
    (folder / f"{sense}.onnx").write_bytes(data)
    (folder / f"{sense}.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    reached = {name: card[name] for name in ("held_out", "seconds")}
    sys.stdout.write(f"{sense}: {json.dumps(reached)}\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--profile", default="standard", help=" or ".join(PROFILES))
    parser.add_argument("--only", choices=SENSES, action="append", help="again for more than one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=own_cores(), help="that make samples")
    parser.add_argument("--meshes", type=Path, help="folder of scanned things, for real-shapes")
    parser.add_argument(
        "--out", "--to", dest="to", type=Path, help="a folder; left out, where the program has its own"
    )
    return parser


def _refused(why: str) -> int:
    sys.stderr.write(f"{why}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main())
