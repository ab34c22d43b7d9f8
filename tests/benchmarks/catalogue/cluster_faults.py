"""The same objects by processes and by a Ray cluster that loses a node and its driver.

``PYTHONPATH=. python tests/benchmarks/catalogue/cluster_faults.py [--objects 30] [--senses touch]`` builds a
catalogue of procedural objects and a poisoned one, first by the local runner and then by three Ray nodes of
one core on this machine. One node is killed when a third is built and the driver when two thirds are; the
build is then begun again. Both must have the same bits, each made once. Tetrahedra are handed from the first
build to the second, since fTetWild would fill otherwise; nothing else is.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.benchmarks.catalogue.drawn_catalogue import (
    answer,
    built,
    command,
    hashes,
    times_made,
    write_catalogue,
)
from tests.benchmarks.results import benchmark_parser, finish_figure


def main() -> None:
    """Build twice, and print or write the figure."""
    parser = benchmark_parser(__doc__)
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
    made, ours, theirs = times_made(folder / "ray"), hashes(folder / "local"), hashes(folder / "ray")
    twice = sum(times > 1 for times in made.values())
    differ = sum(ours.get(name) != theirs.get(name) for name in {*ours, *theirs})
    finish_figure(
        "catalogue",
        "faults",
        f"quantity, profile smoke, {arguments.senses}, {arguments.objects} objects and one broken mesh; "
        "local runner; Ray, one node and the driver killed, then restarted",
        [
            ("objects built by the last call", local["built"], f"{ray['built']}; {ray['standing']} existed"),
            ("broken meshes", str(local["failed"]), str(ray["failed"])),
            ("wall time [s]", local["seconds"], ray["seconds"]),
            (
                "files that differ between the runners",
                f"{differ} of {len(ours)}",
                f"{differ} of {len(theirs)}",
            ),
            ("senses built; more than once", None, f"{len(made)}; {twice}"),
        ],
    )
    shutil.rmtree(folder)


def by_ray(catalogue: Path, out: Path, objects: int, more: tuple[str, ...]) -> dict[str, Any]:
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
            until(lambda: built(out) >= 2 * objects // 3, driver)
            driver.send_signal(signal.SIGKILL)
        return answer(catalogue, out, *more)
    finally:
        cluster.shutdown()


def until(true: Callable[[], bool], driver: subprocess.Popen[bytes], longest: float = 1800.0) -> None:
    """Wait for something while a driver runs."""
    begun = time.monotonic()
    while not true():
        if driver.poll() is not None or time.monotonic() - begun > longest:
            raise SystemExit("the build ended before its driver was to be killed")
        time.sleep(0.2)


if __name__ == "__main__":
    main()
