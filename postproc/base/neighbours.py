"""The packages `machines` and `toolpaths` are those that came with this one.

Their names are short, so that another file or package of the same name may stand before them: a `machines.py` in the present
folder under `python -m postproc`, a package of that name earlier on sys.path or installed over ours.
"""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path

_MARKS = {"machines": ("loader.py", '"""What a machine can do: '),
          "toolpaths": ("toolpath.py", '"""What the cutter must do, ')}
"""by package: a file that it has, how its door begins (another package installed over ours replaces the door alone)"""


def _names_in(folder: Path) -> set[str]:
    try:
        return {one.name for one in folder.iterdir()}
    except OSError:
        return set()


def _door(folder: Path, begins: str) -> bool:
    """True where a package's door begins so."""
    try:
        with (folder / "__init__.py").open(encoding="utf-8", errors="replace") as door:
            return door.read(len(begins)) == begins
    except OSError:
        return False


@cache
def foreign() -> str:
    """What stands in the place of one of our packages, and what to do; "" where all is well.

    Nothing is imported; it is looked at once.
    """
    here = Path(__file__).parents[2]
    for name, (mark, begins) in _MARKS.items():
        spec = importlib.util.find_spec(name)
        places = [Path(one) for one in (spec.submodule_search_locations or [] if spec else [])]
        if here / name not in places or mark not in _names_in(here / name) or not _door(here / name, begins):
            other = spec.origin if spec is not None else "nothing"
            return (f"Python finds {other} in the place of the package {name} of postproc ({here / name}); "
                    "run it from another folder, or install postproc into an environment of its own "
                    "(pipx install WHEEL, or python -m venv and pip install WHEEL)")
    return ""
