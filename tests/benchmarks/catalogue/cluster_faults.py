"""The same objects by processes and by a Ray cluster that loses a node and its driver.

``PYTHONPATH=. python tests/benchmarks/catalogue/cluster_faults.py [--objects 30] [--senses touch]`` builds a
catalogue of procedural objects and a poisoned one, first by the local runner and then by three Ray nodes of
one core on this machine. One node is killed when a third is built and the driver when two thirds are; the
build is then begun again. Both must have the same bits, each made once. Tetrahedra are handed from the first
build to the second, since fTetWild would fill otherwise; nothing else is.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.benchmarks.catalogue.drawn_catalogue import (
    answer,
    built,
    command,
    hashes,
    times_made,
    write_catalogue,
)


def main() -> None:
    """Run it and print one JSON object."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--objects", type=int, default=30)
    parser.add_argument("--senses", default="touch")
    parser.add_argument("--edge", default="15mm")
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="catalogue-"))
    catalogue = write_catalogue(folder / "meshes", arguments.objects, poisoned=True)
    more = ("--senses", arguments.senses, "--edge", arguments.edge, "--modes", "12")
    local = answer(catalogue, folder / "local", *more, "--workers", "2")
    if (folder / "local/stages/arrays").is_dir():
        shutil.copytree(folder / "local/stages/arrays", folder / "ray/stages/arrays")
    ray = by_ray(catalogue, folder / "ray", arguments.objects, more)
    made = times_made(folder / "ray")
    result = {
        "objects": arguments.objects,
        "local": {key: local[key] for key in ("built", "failed", "seconds")},
        "ray": ray,
        "files": len(hashes(folder / "local")),
        "identical": hashes(folder / "local") == hashes(folder / "ray"),
        "senses_made": len(made),
        "made_more_than_once": [key for key, times in made.items() if times > 1],
    }
    print(json.dumps(result))  # noqa: T201
    shutil.rmtree(folder)


def by_ray(catalogue: Path, out: Path, objects: int, more: tuple[str, ...]) -> dict[str, object]:
    """Three nodes, of which one is killed; two drivers, of which the first is."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    nodes = [cluster.add_node(num_cpus=1) for _ in range(2)]
    cluster.wait_for_nodes()
    more = (*more, "--runner", "ray", "--address", cluster.address)
    try:
        with subprocess.Popen(command(catalogue, out, *more), stdout=subprocess.DEVNULL) as driver:
            until(lambda: built(out) >= objects // 3, driver)
            cluster.remove_node(nodes[0], allow_graceful=False)
            at_node = built(out)
            until(lambda: built(out) >= 2 * objects // 3, driver)
            driver.send_signal(signal.SIGKILL)
        at_driver = built(out)
        again = answer(catalogue, out, *more)
    finally:
        cluster.shutdown()
    answered = {key: again[key] for key in ("standing", "built", "failed", "seconds")}
    return {"built_at_node_loss": at_node, "built_at_driver_loss": at_driver, "second_driver": answered}


def until(true: Callable[[], bool], driver: subprocess.Popen[bytes], longest: float = 1800.0) -> None:
    """Wait for something while a driver runs."""
    begun = time.monotonic()
    while not true():
        if driver.poll() is not None or time.monotonic() - begun > longest:
            raise SystemExit("the build ended before its driver was to be killed")
        time.sleep(0.2)


if __name__ == "__main__":
    main()
