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
import json
import sys
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

from experiments.paper.scale_networks import SIZE_INPUTS
from experiments.shape_reconstruction.pcn.paper.inputs import INPUTS as COMPLETION_INPUTS
from experiments.shape_reconstruction.pcn.training.profiles import CompletionProfile
from harness.basics.cores import own_cores

PROFILES = ("paper", "paper-smoke")
"""As published, and one that shows in a minute that all of it runs."""


@dataclass(frozen=True)
class SizeAmounts:
    """Training set sizes and epochs of the networks that estimate scale."""

    shapes: int  #: of the families, a tenth of them held out.
    samples: MappingProxyType[str, int]  #: draws of each shape, by sense.
    epochs: MappingProxyType[str, int]  #: by sense.


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
COMPLETION_AMOUNTS = MappingProxyType(
    {"paper-smoke": CompletionProfile(26, 1, 2, 4), "paper": CompletionProfile(2600, 8, 6000, 32, 4096)}
)


def main(arguments: list[str] | None = None) -> int:
    """Make the samples, fit, print what is reached on shapes that were held out, write."""
    options = _parser().parse_args(arguments)
    names = tuple(SIZE_INPUTS if options.of == "scale" else COMPLETION_INPUTS)
    if unknown := [name for name in options.only or () if name not in names]:
        return _refused(f"{options.of} has no network {unknown[0]}; it has {', '.join(names)}")
    if find_spec("torch") is None:
        return _refused("networks need torch to be trained: pip install '.[author]'")
    from experiments.shape_reconstruction.pcn.training.device import device_of  # needs torch

    device = device_of(options.device)
    if device is None:
        return _refused("torch finds no CUDA device here; leave --device out, or say --device cpu")
    options.to.mkdir(parents=True, exist_ok=True)
    for name in (name for name in names if not options.only or name in options.only):
        began, cpu = time.perf_counter(), time.process_time()
        data, card = _trained(name, options, device)
        card["profile"], card["seconds"] = options.profile, round(time.perf_counter() - began, 1)
        card["cpu_seconds"] = round(time.process_time() - cpu, 1)
        (options.to / f"{name}.onnx").write_bytes(data)
        (options.to / f"{name}.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
        sys.stdout.write(f"{name}: {json.dumps({key: card[key] for key in ('held_out', 'seconds')})}\n")
    return 0


def _trained(name: str, options: argparse.Namespace, device: str) -> tuple[bytes, dict[str, Any]]:
    # Both need torch.
    if options.of == "scale":
        from experiments.paper.scale_training import train_paper_network

        return train_paper_network(name, SIZE_AMOUNTS[options.profile], options.seed, options.processes)
    from experiments.shape_reconstruction.pcn.training.paper.train_paper import train_paper_completion

    amounts = COMPLETION_AMOUNTS[options.profile]
    return train_paper_completion(name, amounts, options.seed, options.processes, device)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("of", choices=("scale", "shape"), help="which table's networks")
    parser.add_argument("--profile", choices=PROFILES, default="paper")
    parser.add_argument("--only", action="append", help="one network; again for more than one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=own_cores(), help="that make samples")
    parser.add_argument(
        "--device", choices=("auto", "cpu", "cuda"), default="auto",
        help="that fits completion; auto: cuda where there is one",
    )  # fmt: skip
    parser.add_argument("--out", "--to", dest="to", type=Path, required=True, help="a folder")
    return parser


def _refused(why: str) -> int:
    sys.stderr.write(f"{why}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main())
