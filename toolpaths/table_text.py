"""Tables as text for people, laid out by rich: the same bytes on a terminal, in a pipe and in a file."""

from __future__ import annotations

from collections.abc import Sequence

_WIDE = 100_000
"""characters: nothing is ever wrapped or cut"""


def table_text(rows: Sequence[Sequence[object]], heads: Sequence[str] = (), align: str = "",
               indent: int = 0) -> list[str]:
    """Lines of a table.

    Args:
        rows: cells, each row of the same length
        heads: names of the columns; none: no line of names
        align: a letter for each column, "l" or "r"; columns beyond stand left
        indent: blanks before each line
    """
    from io import StringIO

    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    count = len(heads) or max((len(row) for row in rows), default=0)
    table = Table(box=None, pad_edge=False, show_header=bool(heads), padding=(0, 2, 0, 0), header_style="")
    for k in range(count):
        table.add_column(Text(heads[k]) if heads else "", justify="right" if align[k:k + 1] == "r" else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(str(cell)) for cell in row))
    out = StringIO()
    Console(file=out, width=_WIDE, color_system=None, force_terminal=False, legacy_windows=False).print(table)
    return [" " * indent + line.rstrip() for line in out.getvalue().splitlines()]
