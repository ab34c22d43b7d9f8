r"""Train point completion networks on drawn household shapes; they never see what they are tested on.

\b
    python -m experiments.shape_reconstruction.pcn.train --profile standard

writes a network by touch, the one that ships, and one by a glance. The glance that ships has learnt from six
times as many shapes, ``--profile long``: six minutes with a graphics processor.

``--profile paper --out FOLDER`` trains the networks of ObjectFolder 2.0 in their published size, by touch, by
a picture and by both, for rows of a table beside ours (``tables shape-reconstruction --set pcn=FOLDER``). It
wants a graphics processor: there seven minutes, without one days. None of those ships.
"""

import argparse
import json
import sys
import time
from importlib.util import find_spec
from pathlib import Path

from experiments.shape_reconstruction.pcn.paper.inputs import INPUTS
from experiments.shape_reconstruction.pcn.training.profiles import PAPER_PROFILES, PROFILES
from harness.basics.cores import own_cores


def main(arguments: list[str] | None = None) -> int:
    """Draw, fit, say what is reached on shapes that were held out, write."""
    options = _parser().parse_args(arguments)
    paper = options.profile in PAPER_PROFILES
    names = tuple(INPUTS) if paper else tuple(PROFILES[options.profile])
    asked = options.only or names
    if unknown := [name for name in asked if name not in names]:
        return _refused(f"--profile {options.profile} has no {unknown[0]}; it has {', '.join(names)}")
    folder: Path | None = options.out
    if paper and folder is None:
        return _refused(f"nothing of --profile {options.profile} ships: add --out FOLDER")
    if find_spec("torch") is None:
        return _refused("the network needs torch to be trained: pip install '.[author]'")
    from experiments.shape_reconstruction.pcn.training.device import device_of  # needs torch

    device = device_of(options.device)
    if device is None:
        return _refused("torch finds no CUDA device here; leave --device out, or say --device cpu")
    folder = folder or Path(__file__).parent / "data"
    folder.mkdir(parents=True, exist_ok=True)
    for name in asked:
        _train(name, options, device, folder)
    return 0


def _train(name: str, options: argparse.Namespace, device: str, folder: Path) -> None:
    """One network with its card, written."""
    # All need torch.
    from experiments.shape_reconstruction.pcn.training.paper.train_paper import train_paper_completion
    from experiments.shape_reconstruction.pcn.training.train_glance import train_glance
    from experiments.shape_reconstruction.pcn.training.train_network import train_network

    began, seconds = time.process_time(), time.perf_counter()
    if options.profile in PAPER_PROFILES:
        amounts = PAPER_PROFILES[options.profile]
        data, card = train_paper_completion(name, amounts, options.seed, options.processes, device)
    elif name == "glance":
        amounts = PROFILES[options.profile][name]
        data, card = train_glance(amounts, options.seed, options.processes, device)
    else:
        data, card = train_network(PROFILES[options.profile][name], options.seed)
    card["cpu_seconds"] = round(time.process_time() - began, 1)
    card["seconds"] = round(time.perf_counter() - seconds, 1)
    _write(folder, name, data, card, options)


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
        "--only", choices=[*PROFILES["standard"], *INPUTS], action="append", help="again for more than one"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=own_cores(), help="that draw samples")
    parser.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="that fits the glance and the paper's; auto: cuda where there is one",
    )
    parser.add_argument("--out", type=Path, help="a folder; left out, where the program has its own")
    return parser


def _refused(why: str) -> int:
    sys.stderr.write(f"{why}\n")
    return 2


if __name__ == "__main__":
    sys.exit(main())
