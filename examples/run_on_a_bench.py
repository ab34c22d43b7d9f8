"""Run on the mocked bench, replay the run and compare it: python examples/run_on_a_bench.py FOLDER."""

import sys
from pathlib import Path

import touchstone

scene = touchstone.SceneOptions(object="mug", sense="touch", keys={"contacts": 2})
made = touchstone.run("contact-localization", scene, seed=1, out=Path(sys.argv[1]))
print(f"{made.report}: {made.result['estimates']['touch']['position_m']}")
again = touchstone.replay(made.folder, ["localization.rounds=0"])
print(f"without refinement: {again.result['estimates']['touch']['position_m']}")
print("\n".join(touchstone.compare(made.folder).summary()))
