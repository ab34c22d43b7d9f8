"""The box's small memory between its converter and the cable: what does not fit is lost."""


class Fifo:
    """Bytes in order, of a finite number.

    Args:
        capacity: bytes.

    Attributes:
        lost: bytes that did not fit since the beginning.
    """

    def __init__(self, capacity: int) -> None:
        self.lost = 0
        self._capacity = capacity
        self._bytes = bytearray()

    def __len__(self) -> int:
        return len(self._bytes)

    def push(self, data: bytes) -> None:
        """Append what fits; the rest is lost, wherever in a scan that may be."""
        free = self._capacity - len(self._bytes)
        self._bytes += data[:free]
        self.lost += max(0, len(data) - free)

    def peek(self, count: int) -> bytes:
        """The oldest ``count`` bytes, or as many as there are."""
        return bytes(self._bytes[:count])

    def drop(self, count: int) -> None:
        """Forget the oldest ``count`` bytes."""
        del self._bytes[:count]

    def clear(self) -> None:
        """Forget everything."""
        self._bytes.clear()
