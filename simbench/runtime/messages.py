"""Messages between a process and its workers: whole, however the pipe delivers them.

Every worker imports this module first. As `simbench.runtime.pool`, it must not import
modules that read environment variables when they are imported.
"""

from __future__ import annotations

import os
import pickle
import struct
from collections.abc import Iterator
from multiprocessing.connection import Connection
from typing import Any

__all__ = ["FORK_NOW", "FORK_PREPARED", "Inbox", "receive", "send"]

FORK_NOW = b"o"
"""Asks the fork server for a process as soon as it can: that imports what it needs."""

FORK_PREPARED = b"p"
"""Asks it for a process that is forked when all has been imported."""

_HEADER = struct.Struct("!Q")  # bytes of the message that follows
_LONGEST = 2**30  # bytes


def send(pipe: Connection, value: object) -> None:
    """Pickle a value and write it as one message."""
    content = pickle.dumps(value)
    data = memoryview(_HEADER.pack(len(content)) + content)
    while data:
        data = data[os.write(pipe.fileno(), data) :]


def receive(pipe: Connection) -> bytes:
    """Wait for one message and return it, still pickled.

    Raises
    ------
    EOFError
        If the other process has closed the pipe.
    """
    (size,) = _HEADER.unpack(_exactly(pipe, _HEADER.size))
    return _exactly(pipe, size)


class Inbox:
    """Messages that arrive on a pipe, read without waiting for the rest of one."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._received = bytearray()

    def messages(self) -> Iterator[Any]:
        """Read the pipe once, and yield the values of the messages that are whole.

        To call when the pipe is ready to be read.

        Raises
        ------
        EOFError
            If the other process has closed the pipe.
        ValueError
            If a message is too long; unpickling may raise anything else.
        """
        data = os.read(self._pipe.fileno(), 2**20)
        self._received += data
        while len(self._received) >= _HEADER.size:
            (size,) = _HEADER.unpack_from(self._received)
            if size > _LONGEST:
                raise ValueError(f"a message of {size} bytes")
            end = _HEADER.size + size
            if len(self._received) < end:
                break
            message = bytes(self._received[_HEADER.size : end])
            del self._received[:end]
            yield pickle.loads(message)
        if not data:
            raise EOFError


def _exactly(pipe: Connection, size: int) -> bytes:
    data = b""
    while len(data) < size:
        more = os.read(pipe.fileno(), size - len(data))
        if not more:
            raise EOFError
        data += more
    return data
