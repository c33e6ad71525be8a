"""Documents of the source tree that pages of the site name, as pages of the site; links of all pages, as the site has them.

A page of `docs` links to the README of a room as it stands in the tree, so that the link also leads somewhere where the tree
is read. `write_pages` copies each such document next to the generated pages, `linked` writes the links of a page anew: to pages
and copies where there is one, else as the words of the link alone. Nothing is left for the build to excuse.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

DOCS = Path(__file__).parent
TREE = DOCS.parent
COPIES = DOCS / "reference" / "generated" / "tree"
LINK = re.compile(r"(?<!!)\[(?P<words>[^\[\]]*)\]\((?P<target>[^()\s]+)\)")


def documents() -> list[Path]:
    """Documents outside `docs` that its pages link to."""
    found = {place for page in sorted(DOCS.rglob("*.md")) if COPIES not in page.parents
             for m in LINK.finditer(page.read_text("utf-8")) if (place := _place(m["target"], page)) is not None}
    return sorted(one for one in found if one.suffix == ".md" and one.is_file() and DOCS not in one.parents)


def copy_of(document: Path) -> Path:
    """The page of the site that is this document."""
    return COPIES / ("-".join(document.relative_to(TREE).with_suffix("").parts) + ".md")


def write_pages() -> None:
    """A copy of each of them."""
    COPIES.mkdir(parents=True, exist_ok=True)
    for document in documents():
        copy_of(document).write_text("---\norphan: true\n---\n\n" + linked(document.read_text("utf-8"), document,
                                                                          copy_of(document)), encoding="utf-8")


def linked(text: str, source: Path, page: Path | None = None) -> str:
    """The text of a page with the links of the site; `page` is where it will stand, where that is not `source`."""
    copied = {one: copy_of(one) for one in documents()}
    return LINK.sub(lambda m: _link(m, source, page or source, copied), text)


def _link(found: re.Match[str], source: Path, page: Path, copied: dict[Path, Path]) -> str:
    place = _place(found["target"], source)
    if place is None:
        return found[0]
    there = copied.get(place, place)
    if DOCS not in there.parents or not there.is_file():
        return found["words"]
    heading = found["target"].partition("#")[2]
    return f"[{found['words']}]({os.path.relpath(there, page.parent)}{'#' + heading if heading else ''})".replace(os.sep, "/")


def _place(target: str, page: Path) -> Path | None:
    """The file that a link of a page names; None where it leads out of the tree, or stays on the page."""
    name = target.partition("#")[0]
    if not name or ":" in name:
        return None
    return Path(os.path.normpath(page.parent / name))
