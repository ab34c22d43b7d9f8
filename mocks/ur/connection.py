"""What every port of the controller does with a client."""

import asyncio


class Connection(asyncio.Protocol):
    """One client, whose transport is at hand for as long as it is there."""

    def __init__(self) -> None:
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        assert isinstance(transport, asyncio.Transport), "a stream server makes stream transports"
        self._transport = transport

    def connection_lost(self, _error: Exception | None) -> None:
        """It has gone."""
        self._transport = None

    def send(self, data: bytes) -> None:
        """To the client, if it is still there."""
        if self._transport is not None:
            self._transport.write(data)

    def close(self) -> None:
        """Hang up."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Reset the connection."""
        if self._transport is not None:
            self._transport.abort()
