r"""Train a point completion network on drawn household shapes; it never sees what it is tested on.

\b
    python -m experiments.shape_reconstruction.pcn.train --profile standard

writes what ships: half an hour of one core at most. ``--profile paper --out FOLDER`` trains the networks of
ObjectFolder 2.0 in their published size, by touch, by a picture and by both, for rows of a table beside ours
(``tables shape-reconstruction --set pcn=FOLDER``). It wants a graphics processor: there ten minutes, without
one days. None of those ships.
"""

import argparse
import json
import sys
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

from experiments.shape_reconstruction.pcn.paper.inputs import INPUTS
from harness.basics.cores import own_cores


@dataclass(frozen=True)
class CompletionProfile:
    """How much is drawn and for how long it is learnt.

    Attributes:
        shapes: drawn; a tenth of them is held out.
        sets: of touches of each.
        steps: of the fit.
        batch: sets a step.
    """

    shapes: int
    sets: int
    steps: int
    batch: int = 12


PROFILES = MappingProxyType(
    {"smoke": CompletionProfile(26, 2, 4), "standard": CompletionProfile(520, 6, 1600)}
)
PAPER_PROFILES = MappingProxyType(
    {"paper-smoke": CompletionProfile(26, 1, 2, 4), "paper": CompletionProfile(2600, 8, 6000, 32)}
)
"""Of the paper's own networks; the first shows in a minute that all of it runs."""


def main(arguments: list[str] | None = None) -> int:
    """Draw, fit, say what is reached on shapes that were held out, write."""
    options = _parser().parse_args(arguments)
    paper = options.profile in PAPER_PROFILES
    folder: Path | None = options.out
    if paper and folder is None:
        return _refused(f"nothing of --profile {options.profile} ships: add --out FOLDER")
    if find_spec("torch") is None:
        return _refused("the network needs torch to be trained: pip install '.[author]'")
    from experiments.shape_reconstruction.pcn.training.paper.device import device_of  # needs torch

    device = device_of(options.device)
    if device is None:
        return _refused("torch finds no CUDA device here; leave --device out, or say --device cpu")
    folder = folder or Path(__file__).parent / "data"
    folder.mkdir(parents=True, exist_ok=True)
    if not paper:
        _train_ours(options, folder)
    for sense in options.only or INPUTS if paper else ():
        _train_paper(sense, options, device, folder)
    return 0


def _train_ours(options: argparse.Namespace, folder: Path) -> None:
    from experiments.shape_reconstruction.pcn.training.train_network import train_network  # needs torch

    began = time.process_time()
    data, card = train_network(PROFILES[options.profile], options.seed)
    card["cpu_seconds"] = round(time.process_time() - began, 1)
    _write(folder, "completion", data, card, options)


def _train_paper(sense: str, options: argparse.Namespace, device: str, folder: Path) -> None:
    # Needs torch.
    from experiments.shape_reconstruction.pcn.training.paper.train_paper import train_paper_completion

    began, amounts = time.perf_counter(), PAPER_PROFILES[options.profile]
    data, card = train_paper_completion(sense, amounts, options.seed, options.processes, device)
    card["seconds"] = round(time.perf_counter() - began, 1)
    _write(folder, sense, data, card, options)


def _write(
    folder: Path, name: str, data: bytes, card: dict[str, object], options: argparse.Namespace
) -> None:
    card = {**card, "profile": options.profile}
    (folder / f"{name}.onnx").write_bytes(data)
    (folder / f"{name}.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    said = {key: card[key] for key in ("held_out", "cpu_seconds", "seconds", "device") if key in card}
    sys.stdout.write(f"{name}: {json.dumps(said)}\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--profile", choices=[*PROFILES, *PAPER_PROFILES], default="standard")
    parser.add_argument(
        "--only", choices=list(INPUTS), action="append", help="of the paper's; again for more"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=own_cores(), help="that draw the paper's samples")
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="that fits the paper's; auto: cuda where there is one",
    )
    parser.add_argument("--out", type=Path, help="a folder; left out, where the program has its own")
    return parser


def _refused(why: str) -> int:
    sys.stderr.write(f"{why}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main())
