"""Parts shared by the programs that train networks: options, refusals, and the files that they write."""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from harness.basics.cores import own_cores
from harness.basics.errors import DataRefused, WrongUse

DEVICES = ("auto", "cpu", "cuda")
"""Processors that a network is fitted on; ``"auto"``: cuda where there is one."""


def training_parser(description: str, profile: str) -> argparse.ArgumentParser:
    """Create a parser with the options of every training and the default ``profile``."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "--profile", default=profile, help=f"amounts of samples and of the fit; {profile} if left out"
    )
    parser.add_argument("--only", action="append", help="one network; may be given again")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=own_cores(), help="processes that make samples")
    parser.add_argument("--out", "--to", dest="to", type=Path, help="folder of the networks")
    return parser


def exit_code(program: Callable[[], None]) -> int:
    """Run a program; print why its options are refused."""
    try:
        program()
    except WrongUse as refusal:
        sys.stderr.write(f"{refusal}\n")
        return 2
    return 0


def chosen_networks(only: list[str] | None, networks: tuple[str, ...]) -> tuple[str, ...]:
    """Return the networks that ``--only`` names, all of them without it.

    Raises:
        WrongUse: there is no network of that name.
    """
    for name in only or ():
        if name not in networks:
            raise WrongUse(f"there is no network {name}; there are {', '.join(networks)}")
    return tuple(name for name in networks if not only or name in only)


def require_torch(advice: str = "") -> None:
    """Raise ``WrongUse`` if torch is not installed; ``advice`` ends the sentence."""
    if find_spec("torch") is None:
        raise WrongUse(f"networks need torch to be trained: pip install '.[author]'{advice}")


def device_of(asked: str) -> str:
    """Return ``"cpu"`` or ``"cuda"`` for one of ``DEVICES``; needs torch.

    Raises:
        WrongUse: ``"cuda"`` is requested, and torch finds no such device.
    """
    import torch

    there = torch.cuda.is_available()
    if asked == "cuda" and not there:
        raise WrongUse("torch finds no CUDA device here; leave --device out, or say --device cpu")
    return "cuda" if there and asked != "cpu" else "cpu"


def write_network(
    name: str, train: Callable[[], tuple[bytes, dict[str, Any]]], folder: Path, profile: str
) -> None:
    """Train a network, write its graph and its card, and print its errors on held-out shapes.

    Args:
        name: name of the network and of its two files.
        train: returns the bytes of the graph, and the card.
        folder: folder of the files; created if missing.
        profile: name of the profile, for the card.
    """
    folder.mkdir(parents=True, exist_ok=True)
    clock, cpu = time.perf_counter(), time.process_time()
    data, card = train()
    card["profile"], card["seconds"] = profile, round(time.perf_counter() - clock, 1)
    card["cpu_seconds"] = round(time.process_time() - cpu, 1)
    (folder / f"{name}.onnx").write_bytes(data)
    (folder / f"{name}.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    printed = {key: card[key] for key in ("held_out", "cpu_seconds", "seconds", "device") if key in card}
    sys.stdout.write(f"{name}: {json.dumps(printed)}\n")


def read_networks(folder: Path, names: Iterable[str], train: str) -> dict[str, bytes]:
    """Read the graphs that ``write_network`` wrote to a folder, by name; some of them may be missing.

    Args:
        folder: folder of the files.
        names: names of the networks.
        train: command that trains them, for messages.

    Raises:
        DataRefused: there is no network, or a card is missing or not JSON.
    """
    found = {}
    for path in [folder / f"{name}.onnx" for name in names]:
        if path.is_file():
            try:
                json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
            except (OSError, ValueError) as error:
                raise DataRefused(f"{path} has no card next to it; train it again: {train}") from error
            found[path.stem] = path.read_bytes()
    if not found:
        files = ", ".join(f"{name}.onnx" for name in names)
        raise DataRefused(f"{folder} has none of {files}; train them: {train}")
    return found
