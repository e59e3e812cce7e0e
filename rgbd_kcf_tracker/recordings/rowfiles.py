# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

"""Tables of many recordings: one file of all rows, as CSV or Parquet."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from rgbd_kcf_tracker.errors import RecordingError
from rgbd_kcf_tracker.recordings.files import cannot_read, open_text
from rgbd_kcf_tracker.recordings.outputs import moved_into_place

SOURCE = 'source'
"""The first column: which recording a row is of."""

_INTEGERS = frozenset({'frame', 'stamp_ns', 'id'})
_TEXTS = frozenset({'state'})


def write_rows(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file as a whole.

    Raises:
        RecordingError: where it cannot be written.
    """
    with _written(path) as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(header)
        writer.writerows(rows)


@contextmanager
def _written(path: Path) -> Iterator[TextIO]:
    """A text file that is put in its place when it is whole; names in it need not be UTF-8."""
    with (
        moved_into_place(path) as temporary,
        temporary.open('w', encoding='utf-8', errors='backslashreplace', newline='') as file,
    ):
        yield file


def join_csv(files: Mapping[str, Path], path: Path) -> None:
    """Put the rows of CSV files of one header into one file, behind the name of each.

    One recording is held at a time.

    Args:
        files: by name.
        path: ends in ``.csv``, or in ``.parquet``, which needs pyarrow.

    Raises:
        RecordingError: where a file cannot be read, has another header, or the table cannot be
            written.
    """
    if path.suffix == '.parquet':
        _join_parquet(files, path)
        return
    header = _common_header(files)
    with _written(path) as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow([SOURCE, *header])
        for name, source in files.items():
            with _opened(source) as rows:
                next(rows, None)
                writer.writerows([name, *row] for row in rows)


def _join_parquet(files: Mapping[str, Path], path: Path) -> None:
    import pyarrow
    from pyarrow import csv as arrow_csv
    from pyarrow import parquet

    header = _common_header(files)
    types = {column: _type(column) for column in header}
    schema = pyarrow.schema([(SOURCE, pyarrow.string()), *types.items()])
    options = arrow_csv.ConvertOptions(
        column_types=types, null_values=[''], strings_can_be_null=True
    )
    with moved_into_place(path) as temporary:
        try:
            with parquet.ParquetWriter(temporary, schema) as writer:
                for name, source in files.items():
                    table = arrow_csv.read_csv(source, convert_options=options)
                    names = pyarrow.array([name] * len(table), pyarrow.string())
                    writer.write_table(table.add_column(0, SOURCE, names))
        except (pyarrow.ArrowException, OSError) as error:
            raise RecordingError(f'{path} cannot be written: {error}') from None


def _common_header(files: Mapping[str, Path]) -> list[str]:
    """The columns of all files; none where there are no files."""
    header: list[str] | None = None
    for source in files.values():
        with _opened(source) as rows:
            own = next(rows, [])
        if header is not None and own != header:
            raise RecordingError(
                f'{source}, line 1: the columns {",".join(own)} are not those of the others, '
                f'{",".join(header)}'
            )
        header = own
    return header or []


def _type(column: str) -> object:
    import pyarrow

    if column in _INTEGERS:
        return pyarrow.int64()
    return pyarrow.string() if column in _TEXTS else pyarrow.float64()


@contextmanager
def _opened(path: Path) -> Iterator[Iterator[list[str]]]:
    try:
        with open_text(path) as file:
            yield csv.reader(file)
    except OSError as error:
        raise RecordingError(cannot_read(path, error)) from None
