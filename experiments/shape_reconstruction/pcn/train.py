r"""Train the point completion network on drawn household shapes; it never sees what it is tested on.

\b
    python -m experiments.shape_reconstruction.pcn.train --profile standard
"""

import argparse
import json
import sys
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType


@dataclass(frozen=True)
class CompletionProfile:
    """How much is drawn and for how long it is learnt.

    Attributes:
        shapes: drawn; a tenth of them is held out.
        sets: of touches of each.
        steps: of the fit.
    """

    shapes: int
    sets: int
    steps: int


PROFILES = MappingProxyType(
    {"smoke": CompletionProfile(26, 2, 4), "standard": CompletionProfile(520, 6, 1600)}
)


def main(arguments: list[str] | None = None) -> int:
    """Draw, fit, say what is reached on shapes that were held out, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--profile", choices=list(PROFILES), default="standard")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "data", help="a folder")
    options = parser.parse_args(arguments)
    if find_spec("torch") is None:
        sys.stderr.write("the network needs torch to be trained: pip install '.[author]'\n")
        return 2
    from experiments.shape_reconstruction.pcn.training.train_network import train_network  # needs torch

    began = time.process_time()
    data, card = train_network(PROFILES[options.profile], options.seed)
    card["profile"], card["cpu_seconds"] = options.profile, round(time.process_time() - began, 1)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "completion.onnx").write_bytes(data)
    (options.out / "completion.json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(json.dumps({name: card[name] for name in ("held_out", "cpu_seconds")}) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
