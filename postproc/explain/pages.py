"""The page of a code: what it is about, how it is worded, what to do, an example where there is one."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files

from toolpaths.dataclass import dataclass


@dataclass(frozen=True)
class CodePage:
    """What is known of a code; `...` in messages and remedies stands for what is filled in."""

    code: str
    about: str
    messages: tuple[str, ...]
    remedies: tuple[str, ...]
    first: str
    example: str

    def text(self) -> str:
        """For people."""
        lines = [self.code, "", self.about]
        if self.messages:
            lines += ["", "It is worded (... stands for what is found):", *(f"  {one}" for one in self.messages)]
        if self.remedies:
            lines += ["", "What to do:", *(f"  {one}" for one in self.remedies)]
        lines += ["", "First of all:" if self.remedies else "What to do:", f"  {self.first}"]
        if self.example:
            said = f"[{self.code}]" in self.example
            obeyed = any(line.startswith("+") for line in self.example.splitlines())
            title = ("An example, as it is said:" if said else "An example (- as found, + put right):" if obeyed
                     else "A CL file that has it:")
            lines += ["", title, *(f"  {one}" for one in self.example.splitlines())]
        return "\n".join(lines)


@cache
def pages() -> dict[str, CodePage]:
    """All pages by code."""
    areas, codes = (tomllib.loads((files(__package__) / name).read_text("utf-8")) for name in ("areas.toml", "codes.toml"))
    result = {}
    for code, one in codes.items():
        area = areas[code.split(".")[0]]
        result[code] = CodePage(code, area["about"], tuple(one["messages"]), tuple(one["remedies"]), area["first"],
                                one.get("example", ""))
    return result


def unknown(code: str) -> str:
    """A hint for a code that there is not: the nearest, else those of its area, else the areas."""
    from machines.value_words import nearest

    known = list(pages())
    same = [one for one in known if one.split(".")[0] == code.split(".")[0]]
    areas = dict.fromkeys(one.split(".")[0] for one in known)
    return nearest(code, same) if same else f"codes begin with {', '.join(areas)}"
