"""Reading of Parquet tables that others wrote, of bounded size once decoded."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from simbench.core.errors import DatasetError
from simbench.datasets.parquet_footer import value_count

__all__ = ["LARGEST_TABLE", "parse_table"]

LARGEST_TABLE: Final = 256 * 2**20
"""Most bytes of a table's file."""
_LARGEST_DECODED: Final = 512 * 2**20
_MOST_VALUES: Final = 50_000_000


def parse_table(
    content: bytes, where: object, columns: Sequence[str] | None = None
) -> pa.Table:
    """Return a table from the bytes of a Parquet file.

    Parameters
    ----------
    content : bytes
    where : object
        The file, for messages.
    columns : sequence of str, optional
        Only these.

    Raises
    ------
    DatasetError
        If it is no table, or one that would not fit into memory.
    """
    try:
        file = pq.ParquetFile(io.BytesIO(content))
        _require_small(file.metadata, value_count(content), where)
        return file.read(None if columns is None else list(columns))
    except (
        OSError,
        MemoryError,
        OverflowError,
        ValueError,  # among others of a column's name that is no text
        pa.ArrowException,
    ) as error:
        first_line = str(error).partition("\n")[0]
        raise DatasetError(f"{where}: not a readable table: {first_line}") from None


def _require_small(metadata: pq.FileMetaData, values: int, where: object) -> None:
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    decoded = sum(abs(group.total_byte_size) for group in groups)
    values = max([values, *(group.num_rows for group in groups)])
    if decoded > _LARGEST_DECODED or values > _MOST_VALUES:
        raise DatasetError(
            f"{where}: expected a table of at most {_LARGEST_DECODED} bytes and "
            f"{_MOST_VALUES} values, got {decoded} and {values}"
        )
