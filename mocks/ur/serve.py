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
from collections.abc import Callable
from typing import Final

from mocks.ur.controller import Controller
from mocks.ur.faults import Faults
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
        config: of the controller.
        contact: what the tool feels; nothing where None.
        on_cycle: is told where the arm is.
        should_stop: ends it.
        step: of the run.
        cues: faults to begin (``mocks.ur.faults``).
        on_ready: is called once, when all ports listen.
        answer: is told what became of each cue.
        on_outputs: is told when a digital output changes.

    Raises:
        OSError: an address or port that cannot be bound.
        harness.basics.errors.WrongUse: a model that is not known.
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
