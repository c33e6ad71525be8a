"""Bytes of large files that are asked for again much later: on disk meanwhile, not in memory."""

from __future__ import annotations

import os
import weakref

LARGE = 4_000_000
"""bytes from which on they are put aside"""


class Aside:
    """Bytes in a file without a name, which goes with this value, or with the process."""

    def __init__(self, data: bytes) -> None:
        import tempfile  # which starting a command would wait for

        self._size, self._file = len(data), tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  # open as long as this is
        weakref.finalize(self, self._file.close)
        left = memoryview(data)
        while len(left):
            left = left[self._file.write(left):]

    def data(self) -> bytes:
        """The bytes; processes and threads that share the file do not move each other's place in it."""
        parts, at = list[bytes](), 0
        while at < self._size:
            parts.append(os.pread(self._file.fileno(), self._size - at, at))
            at += len(parts[-1])
            if not parts[-1]:
                raise OSError("the copy of a file that was put aside is cut off")
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def __reduce__(self) -> tuple[object, ...]:
        return aside, (self.data(),)


def aside(data: bytes) -> bytes | Aside:
    """Bytes, on disk where they are many and there is room."""
    if len(data) < LARGE or not hasattr(os, "pread"):
        return data
    try:
        return Aside(data)
    except OSError:
        return data
