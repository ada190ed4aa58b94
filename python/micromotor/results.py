"""What a function gives: the result that the command prints, and courses as arrays."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

Table = dict[str, NDArray[Any]]
"""Columns of equal length by their names, which end in their unit. ``pandas.DataFrame(table)`` makes a frame of one
whose columns have one number a row."""


class Result(dict[str, Any]):
    """The result of a run or a study: the JSON object that the command prints, as a dictionary.

    Attributes:
        json: The text that the command prints with ``--format json`` for the same scene, to the byte, but for the time
            that ``simulate`` took.
        tables: What has a row for each instant, run or sample: columns by their names, by the name of the table.
    """

    json: str
    tables: dict[str, Table]

    def __init__(self, text: str, tables: dict[str, Table] | None = None) -> None:
        super().__init__(json.loads(text))
        self.json = text
        self.tables = {} if tables is None else tables

    @property
    def course(self) -> Table:
        """The table ``course``: one row for each instant that was kept."""
        return self.tables["course"]

    def __repr__(self) -> str:
        tables = {name: len(next(iter(table.values()), np.empty(0))) for name, table in self.tables.items()}
        return f"Result({dict.__repr__(self)}, rows={tables})"
