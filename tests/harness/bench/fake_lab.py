"""A stand-in for ``python -m mocks.lab`` that speaks its protocol and has no instruments.

What it does is chosen by ``--seed``: 0 serves; 1 is not ready; 2 dies; 3 says nothing; 4 dies at a mark.
"""

import argparse
import json
import sys
import time
from pathlib import Path


def say(answer: object) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def main() -> None:
    parser = argparse.ArgumentParser()
    for name in ("--scene", "--seed", "--gap", "--truth"):
        parser.add_argument(name, required=True)
    parser.add_argument("--run", default="")
    arguments = parser.parse_args()
    if arguments.seed == "1":
        say({"ready": False, "error": "no loopback address is free"})
        sys.exit(1)
    if arguments.seed == "2":
        sys.exit("it broke\n")
    if arguments.seed == "3":
        time.sleep(600)
    told = json.loads(Path(arguments.scene).read_text(encoding="utf-8"))
    gel = "http://127.7.7.7:8080/?action=stream"
    say({"ready": True, "addresses": {"arm": "127.7.7.7", "gel": gel}, "environment": {}})
    for line in sys.stdin:
        request = json.loads(line)
        if "told" in request:
            say({"told": told})
        elif "mark" in request and arguments.seed == "4":
            sys.exit("the world ended\n")
        elif "mark" in request:
            say({"marked": request["mark"]})
        elif request.get("fault", {}).get("kind") == "nonsense":
            say({"error": "the gel has no fault 'nonsense'"})
        else:
            say({"begun": request["fault"]})


main()
