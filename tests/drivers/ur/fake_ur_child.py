"""A child process that misbehaves on cue: ``python fake_ur_child.py MODE FILE``; requests go to FILE."""

import json
import os
import queue
import sys
import threading
import time
from pathlib import Path

import numpy as np

from drivers.ur import pipe
from harness.basics.geometry import vector_from_rotation
from harness.bench import kinematics

READY = np.array([0.0, -1.4, 1.7, -1.87, -1.57, 0.0])


def packet(joints: np.ndarray, moving: bool, force: float) -> bytes:
    values, flange = np.zeros(pipe.WIDTH), kinematics.forward("ur5e", joints)
    values[pipe.FIELDS["time"]] = values[pipe.FIELDS["controller_time"]] = time.monotonic()
    values[pipe.FIELDS["joints"]] = joints
    values[pipe.FIELDS["pose"]] = [*flange[:3, 3], *vector_from_rotation(flange[:3, :3])]
    values[pipe.FIELDS["wrench"]][2] = force
    values[pipe.FIELDS["safety_bits"]] = 1
    values[pipe.FIELDS["moving"]] = moving
    return pipe.packet_frame(values)


def main() -> None:
    mode, log = sys.argv[1], Path(sys.argv[2])
    out = sys.stdout.fileno()
    requests: queue.SimpleQueue[pipe.Message] = queue.SimpleQueue()
    if mode == "mute":
        time.sleep(60)
    if mode == "refuse":
        text = "switch it to remote control at the pendant"
        os.write(out, pipe.message_frame({"id": 0, "ok": False, "error": "BenchFault", "text": text}))
        return

    def read() -> None:
        for _, payload in pipe.read_frames(sys.stdin.fileno()):
            requests.put(pipe.unpack_message(payload))
        os._exit(0)

    if mode == "shut":
        os.write(sys.stderr.fileno(), b"free(): invalid pointer\n")
        os.close(sys.stdin.fileno())
    elif mode != "deaf":
        threading.Thread(target=read, daemon=True).start()
    os.write(out, pipe.message_frame({"id": 0, "ok": True, "value": ["UR5", "1234", "5.12.0"]}))
    joints, moving, moving_id, end, start = READY.copy(), False, 0, 0.0, time.monotonic()
    force = 7.0 if mode == "pulled" else 0.0
    while True:
        silent = {"stale": (0.2, np.inf), "hiccup": (0.2, 1.1)}.get(mode, (np.inf, np.inf))
        if not silent[0] <= time.monotonic() - start < silent[1]:
            os.write(out, packet(joints, moving, force))
        try:
            request = requests.get(timeout=0.005)
        except queue.Empty:
            request = None
        if request and request["do"] != "beat":
            with log.open("a") as lines:
                lines.write(json.dumps(request) + "\n")
            answer = {"id": request["id"], "ok": True, "value": True}
            if request["do"] == "move":
                if mode == "crash":
                    os.write(sys.stderr.fileno(), b"free(): invalid pointer\n")
                    os.abort()
                if mode == "pstop":
                    refusal = {"ok": False, "error": "ProtectiveStop", "text": "it stopped at (1, 2, 3) mm"}
                    os.write(out, pipe.message_frame({"id": request["id"], **refusal}))
                    continue
                moving, moving_id, end = True, request["id"], time.monotonic() + 0.1
                target = request.get("joints")
            elif request["do"] == "stop" and moving:
                moving = False
                refusal = {"ok": False, "error": "SafetyStop", "text": "stopped by request"}
                os.write(out, pipe.message_frame({"id": moving_id, **refusal}))
                os.write(out, pipe.message_frame(answer))
            elif request["do"] != "stop" or mode != "no stop":
                os.write(out, pipe.message_frame(answer))
        if moving and mode not in ("hang", "no stop") and time.monotonic() > end:
            joints, moving = np.array(target) if target else joints, False
            os.write(out, pipe.message_frame({"id": moving_id, "ok": True, "value": True}))


main()
