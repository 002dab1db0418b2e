"""Number of values that a Parquet file says it has, read from its footer.

PyArrow tells it by ``RowGroupMetaData.column``, which ends the whole process on a
column whose size statistics are damaged; all other calls raise. The footer is a Thrift
structure in the compact protocol.

References
----------
Apache Parquet, ``parquet.thrift``; Apache Thrift, "Thrift compact protocol encoding".
"""

from __future__ import annotations

import struct
from typing import Any, Final

__all__ = ["value_count"]

_TRUE, _FALSE, _BYTE, _DOUBLE, _BINARY = 1, 2, 3, 7, 8
_WHOLE: Final = (4, 5, 6)  # of 16, 32 and 64 bits
_LISTS: Final = (9, 10)
_STRUCT: Final = 12  # Parquet has no map
_ROW_GROUPS, _COLUMNS, _META_DATA, _NUM_VALUES = 4, 1, 3, 5  # fields of the structures
_DEEPEST: Final = 16


def value_count(content: bytes) -> int:
    """Return the number of values of all columns, those in lists counted singly.

    Parameters
    ----------
    content : bytes
        Of a whole Parquet file whose footer is not encrypted.

    Raises
    ------
    ValueError
        If its footer cannot be read.
    """
    try:
        (length,) = struct.unpack("<I", content[-8:-4])
        footer = _Reader(content[-8 - length : -8]).structure(0)
        return sum(
            abs(column[_META_DATA][_NUM_VALUES])
            for group in footer[_ROW_GROUPS]
            for column in group[_COLUMNS]
        )
    except (IndexError, KeyError, TypeError, struct.error) as error:
        raise ValueError(f"its footer cannot be read: {error!r}") from None


class _Reader:
    """Reads values one after another."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._at = 0

    def structure(self, depth: int) -> dict[int, Any]:
        """Return the fields of a structure by number."""
        if depth > _DEEPEST:
            raise ValueError(f"its footer is more than {_DEEPEST} levels deep")
        fields: dict[int, Any] = {}
        number = 0
        while head := self._byte():
            kind, step = head & 15, head >> 4
            number = number + step if step else self._whole()
            fields[number] = self._value(kind, depth)
        return fields

    def _value(self, kind: int, depth: int) -> Any:
        if kind in (_TRUE, _FALSE):
            return kind == _TRUE
        if kind in _WHOLE:
            return self._whole()
        if kind in _LISTS:
            return self._list(depth)
        if kind == _STRUCT:
            return self.structure(depth + 1)
        sizes = {_BYTE: 1, _DOUBLE: 8}
        size = self._varint() if kind == _BINARY else sizes[kind]
        if size > len(self._content) - self._at:
            raise ValueError("its footer is cut off")
        self._at += size
        return self._content[self._at - size : self._at]

    def _list(self, depth: int) -> list[Any]:
        head = self._byte()
        count = head >> 4 if head >> 4 < 15 else self._varint()
        kind = head & 15
        if count > len(self._content) - self._at:  # each takes a byte at least
            raise ValueError("its footer is cut off")
        if kind in (_TRUE, _FALSE):
            return [self._byte() == _TRUE for _ in range(count)]
        return [self._value(kind, depth) for _ in range(count)]

    def _whole(self) -> int:
        """Return a whole number, whose sign is its lowest bit."""
        number = self._varint()
        return number >> 1 ^ -(number & 1)

    def _varint(self) -> int:
        number = 0
        for shift in range(0, 70, 7):
            byte = self._byte()
            number |= (byte & 127) << shift
            if byte < 128:
                return number
        raise ValueError("its footer has a number of more than 64 bits")

    def _byte(self) -> int:
        byte = self._content[self._at]
        self._at += 1
        return byte
