"""Reads a table of TOML into a frozen dataclass: one rule per field, all faults reported at once.

A field is declared with its default, unit and allowed range (`number(0.5, low=0, high=1)`); a field without a
default is required. `read_table` checks types, ranges, unknown keys and files. It collects every fault as a
SceneError with the key path, the value, the limit and the mend.
"""

from paradize.scene.schema.field import MOST_FAULTS, Faults, header
from paradize.scene.schema.file_fields import source, sources
from paradize.scene.schema.limit_fields import Limit, Limits, limits
from paradize.scene.schema.number_fields import (
    FAR,
    FARTHEST,
    number,
    number_or,
    numbers,
    point,
    points,
    scale,
    vector,
    whole,
)
from paradize.scene.schema.table_fields import named_tables, read_table, table, tables
from paradize.scene.schema.word_fields import (
    choice,
    choices,
    code,
    day,
    flag,
    identifier,
    one_of,
    text,
    texts,
    words,
)

__all__ = [
    "FAR",
    "FARTHEST",
    "MOST_FAULTS",
    "Faults",
    "Limit",
    "Limits",
    "choice",
    "choices",
    "code",
    "day",
    "flag",
    "header",
    "identifier",
    "limits",
    "named_tables",
    "number",
    "number_or",
    "numbers",
    "one_of",
    "point",
    "points",
    "read_table",
    "scale",
    "source",
    "sources",
    "table",
    "tables",
    "text",
    "texts",
    "vector",
    "whole",
    "words",
]
