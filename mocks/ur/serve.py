"""Run a mocked UR controller on a loopback address until told to stop.

Ports: 29999 dashboard, 30001 to 30003 programs, 30004 real-time data exchange, 30011 messages.
``serve`` blocks; give it a process of its own. ::

    serve(
        ControllerConfig(host="127.0.0.2"),
        contact=model,                        # .wrench(base_from_flange, time) once a cycle
        on_cycle=publish,                     # (time, joints, base_from_flange) once a cycle
        should_stop=line.should_stop,         # asked every 50 ms
        step=lambda: shared.mark.step,        # keys the force noise; asked when a motion starts
        cues=line.fault,                      # the next fault, or None; asked every 10 ms
        on_ready=line.ready,                  # once, when all ports listen
        on_outputs=switched,                  # (bits) whenever a digital output changes
    )

The controller's cycles keep an absolute schedule of 2 ms; those that are a little late are made up
for one by one, so the stream of time stamps has no gaps.
"""

import asyncio
import contextlib
import selectors
import sys
from collections.abc import Callable, Iterable
from typing import Final

from mocks.ur.controller import Controller
from mocks.ur.hooks import CYCLE, ContactModel, ControllerConfig, Cue, OnCycle, OnOutputs
from mocks.ur.ports import (
    Connection,
    Dashboard,
    DashboardConnection,
    ScriptConnection,
    ScriptServer,
    announce_programs,
)
from mocks.ur.rtde_server import RtdeConnection, RtdeServer

KINDS: Final = (
    "none",
    "protective_stop",
    "emergency_stop",
    "release_emergency_stop",
    "drop",
    "freeze",
    "local_control",
    "remote_control",
    "kill_program",
    "broken_force_sensor",
)
"""none: every lasting fault ends. drop: connections are reset, and refused for as long as it lasts.
freeze: the real-time exchange neither sends nor reads, as with a loose cable; the arm goes on.
broken_force_sensor: its readings are no numbers."""


class Faults:
    """Begins and ends them.

    Args:
        controller: that fails.
        rtde: its port 30004.
        others: open connections of its other ports.
    """

    def __init__(
        self,
        controller: Controller,
        rtde: RtdeServer,
        others: Callable[[], Iterable[Connection]],
    ) -> None:
        self._controller = controller
        self._rtde = rtde
        self._others = others
        self._until: float | None = None

    def begin(self, cue: Cue) -> str:
        """Begin a cue; return its description, or the reason for a refusal."""
        controller = self._controller
        match cue.kind:
            case "none":
                self._clear()
            case "protective_stop":
                controller.protective_stop("a fault was cued")
            case "emergency_stop":
                controller.emergency_stop()
            case "release_emergency_stop":
                controller.robot.safety.release_button()
            case "drop":
                seconds = cue.seconds
                self._rtde.drop()
                for connection in self._others():
                    connection.abort()
                if seconds is not None:
                    self._rtde.refusing = True
                    self._last(seconds)
            case "freeze":
                self._rtde.freeze(True)
                self._last(cue.seconds)
            case "local_control" | "remote_control":
                controller.robot.remote = cue.kind == "remote_control"
            case "kill_program":
                controller.complain("program killed")
                controller.player.stop()
            case "broken_force_sensor":
                controller.robot.force.broken = True
                self._last(cue.seconds)
            case _:
                return f"a controller has no fault {cue.kind!r}; it has {', '.join(KINDS)}"
        return f"begun: {cue.kind}"

    def tick(self) -> None:
        """End what has lasted long enough."""
        if self._until is not None and self._controller.robot.time >= self._until:
            self._clear()

    def _last(self, seconds: float | None) -> None:
        self._until = None if seconds is None else self._controller.robot.time + seconds

    def _clear(self) -> None:
        self._rtde.freeze(False)
        self._rtde.refusing = False
        self._controller.robot.force.broken = False
        self._until = None


DASHBOARD_PORT: Final = 29999
SCRIPT_PORTS: Final = (30001, 30002, 30003)
RTDE_PORT: Final = 30004
PRIMARY_PORT: Final = 30011

_CUES_EVERY: Final = 5
_STOP_EVERY: Final = 25
_BURST: Final = 4
"""Late cycles made up for before the ports are served again."""

_LATEST: Final = 0.02
"""s of delay that are made up for. Where the machine stood still for longer, so did the clients, and
the controller's clock stands still with them: else it would run past the watchdogs they kick."""

_SWITCH_INTERVAL: Final = 5e-4
"""s that the translating thread may hold the interpreter while a cycle is due."""


def serve(
    config: ControllerConfig,
    contact: ContactModel | None,
    on_cycle: OnCycle | None,
    should_stop: Callable[[], bool],
    *,
    step: Callable[[], int] = lambda: 0,
    cues: Callable[[], Cue | None] = lambda: None,
    on_ready: Callable[[], None] = lambda: None,
    answer: Callable[[str], None] = lambda _: None,
    on_outputs: OnOutputs | None = None,
) -> None:
    """Serve until ``should_stop``; every port is closed on return.

    Args:
        config: configuration of the controller.
        contact: model of the contact force on the tool; None for no contact.
        on_cycle: function that receives the pose of the arm in every cycle.
        should_stop: function that returns true to end the server.
        step: function that returns the number of the current step, for the force noise.
        cues: faults to begin (``mocks.ur.serve``).
        on_ready: function that is called once, when all ports listen.
        answer: function that receives the outcome of each cue.
        on_outputs: function that is called when a digital output changes.

    Raises:
        OSError: an address or port that cannot be bound.
        harness.basics.errors.WrongUse: an unknown model.
    """
    sys.setswitchinterval(_SWITCH_INTERVAL)
    controller = Controller(config, contact, on_cycle, step, on_outputs)
    # The default selector's timers are a millisecond coarse, half a cycle.
    loop = asyncio.SelectorEventLoop(selectors.SelectSelector())
    try:
        loop.run_until_complete(_serve(controller, should_stop, cues, on_ready, answer))
    finally:
        loop.close()


async def _serve(
    controller: Controller,
    should_stop: Callable[[], bool],
    cues: Callable[[], Cue | None],
    on_ready: Callable[[], None],
    answer: Callable[[str], None],
) -> None:
    rtde, scripts, dashboard = RtdeServer(controller), ScriptServer(controller), Dashboard(controller)
    dashboards, readers = (
        set[DashboardConnection](),
        set[Connection](),
    )  # of the dashboard and of the primary port
    announce_programs(controller, readers)
    faults = Faults(controller, rtde, lambda: {*scripts.connections, *readers, *dashboards})

    async def listen(port: int, protocol: Callable[[], asyncio.Protocol]) -> None:
        server = await asyncio.get_running_loop().create_server(protocol, controller.robot.config.host, port)
        stack.callback(server.close)

    async with contextlib.AsyncExitStack() as stack:
        stack.push_async_callback(scripts.close)
        await listen(DASHBOARD_PORT, lambda: DashboardConnection(dashboard, dashboards))
        for port in SCRIPT_PORTS:
            await listen(port, lambda: ScriptConnection(scripts))
        await listen(RTDE_PORT, lambda: RtdeConnection(rtde))
        await listen(PRIMARY_PORT, lambda: Connection(readers))
        on_ready()
        schedule = _Schedule()
        while schedule.count % _STOP_EVERY or not should_stop():
            await schedule.next_cycle()
            controller.cycle()
            faults.tick()
            rtde.publish()
            if schedule.count % _CUES_EVERY == 0 and (cue := cues()) is not None:
                answer(faults.begin(cue))


class _Schedule:
    """When each cycle is due, from now on."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._due = self._loop.time()
        self.count = 0

    async def next_cycle(self) -> None:
        """Return when the next cycle is due; the ports are served meanwhile."""
        self._due += CYCLE
        self.count += 1
        wait = self._due - self._loop.time()
        if wait > 0.0 or self.count % _BURST == 0:
            await asyncio.sleep(max(wait, 0.0))
        if wait < -_LATEST:
            self._due = self._loop.time()
