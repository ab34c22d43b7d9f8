"""The mocked station opened as a run opens it: over every wire, and gone afterwards."""

import os
import socket
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import BenchFault
from harness.bench.device import CAMERA
from harness.bench.named_files import SHIPPED
from harness.bench.scene import load_scene
from harness.bench.station import RunContext, open_station
from harness.bench.station_file import load_station, station_path
from harness.objects.household import build


def test_a_mocked_bench_opens_reads_and_leaves_nothing_behind(tmp_path: Path) -> None:
    scene = load_scene(SHIPPED / "scenes" / "mug_touch.toml")
    scene = scene.model_copy(update={"sensors": scene.sensors.model_copy(update={"camera": True})})
    station = load_station(station_path("mock"))
    truth = tmp_path / "run.truth.json"
    with open_station(station, scene, RunContext(truth, build("mug"), seed=5, gap="none")) as bench:
        assert bench.lab is not None
        process_id = bench.lab.process_id
        bench.mark(0, 0)
        frames = bench.gel.read(2, 5.0)
        assert frames.values.shape[1:] == (120, 160, 3)
        assert bench.get(CAMERA).read(1, 5.0).values.shape == (1, 480, 640, 3)
        assert np.isfinite(bench.arm.state().joints).all()
        address = bench.gel.health().identity.rpartition("http://")[2].partition(":")[0]
        assert truth.is_file()
    with pytest.raises(ProcessLookupError):
        os.kill(process_id, 0)
    with socket.socket() as probe:
        assert probe.connect_ex((address, 8080)) != 0
    with pytest.raises(BenchFault, match="station"):
        bench.mark(0, 1)
