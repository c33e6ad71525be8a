"""Pages of the reference that are made from the program itself: commands, keys of files, codes of messages.

They go into docs/reference/generated, which is not kept. Run by conf.py before every build.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from typer.main import get_command
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.cli.shared.schemas import FILES, RESULTS, file_schema, result_schema
from postproc.explain.pages import CodePage, pages


def write_pages(folder: Path) -> None:
    """All pages, from scratch."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "codes").mkdir(parents=True)
    (folder / "commands.md").write_text(commands_page(), encoding="utf-8")
    for kind, text in key_pages():
        (folder / f"{kind}.md").write_text(text, encoding="utf-8")
    for code, page in pages().items():
        (folder / "codes" / f"{code}.md").write_text(code_page(page), encoding="utf-8")
    (folder / "codes.md").write_text(codes_page(), encoding="utf-8")
    (folder / "results.md").write_text(results_page(), encoding="utf-8")
    write_schemas(folder / "pages" / "schemas")


def write_schemas(folder: Path) -> None:
    """Each schema as a file of the site, by the name that `postproc schema` takes."""
    folder.mkdir(parents=True)
    for name, schema in [*((one, file_schema(one)) for one in FILES), *((one, result_schema(one)) for one in RESULTS)]:
        (folder / f"{name.replace(' ', '-')}.json").write_text(json.dumps(schema, indent=2) + "\n", encoding="utf-8")


def results_page() -> str:
    """Keys that stay of what each command writes, and where its schema is."""
    parts = ["# JSON of each command: keys that stay", "", "`postproc schema COMMAND` prints the schema. In every object "
             "stand `schema_version`, `ok` and `diagnostics` too; more keys may come.", ""]
    for command, keys in RESULTS.items():
        parts += [f"## {command}", "", f'<a href="../../schemas/{command.replace(" ", "-")}.json">Its schema</a>', "",
                  *(["| key | type |", "|---|---|", *(f"| `{key}` | {kind} |" for key, kind in keys.items())] if keys else
                    ["No further keys."]), ""]
    return "\n".join(parts)


def commands_page() -> str:
    """Every command with its help."""
    parts = ["# Commands", "", "`postproc COMMAND --help` says the same. Exit codes: 0 done, 1 the input has errors, "
             "2 wrong use, 70 a fault of postproc, 130 interrupted.", ""]
    for words in _commands(get_command(app), ()):
        ran = CliRunner().invoke(app, [*words, "--help"])
        parts += [f"## {' '.join(words)}", "", "```text", ran.output.strip(), "```", ""]
    return "\n".join(parts)


def _commands(command: Any, words: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Words of each command that does something."""
    for name in command.list_commands(None):
        one = command.commands[name]
        if hasattr(one, "commands"):
            yield from _commands(one, (*words, name))
        else:
            yield (*words, name)


def key_pages() -> Iterator[tuple[str, str]]:
    """A table of keys for each file that users write."""
    for name in FILES:
        schema = file_schema(name)
        title = "postproc.toml" if name == "job-file" else name.replace("-", " ").capitalize()
        rows = ["| key | type | default | meaning |", "|---|---|---|---|"]
        tops = [schema["$defs"][_name_of(one)] for one in schema.get("anyOf", [])] or [schema]
        seen: set[str] = set()
        for top in tops:
            rows += [row for row in _rows(top, schema, "", ()) if not (row in seen or seen.add(row))]
        yield name, f"# {title}: all keys\n\n" + "\n".join(rows) + "\n"


def _name_of(reference: Mapping[str, Any]) -> str:
    return str(reference["$ref"]).rpartition("/")[2]


def _rows(node: Mapping[str, Any], schema: Mapping[str, Any], path: str, above: tuple[str, ...]) -> Iterator[str]:
    """A row for each key, those of tables within it too."""
    needed = set(node.get("required", []))
    for key, value in node.get("properties", {}).items():
        if key == "$schema":
            continue
        here = f"{path}{key}"
        default = "required" if key in needed else _short(value.get("default"))
        yield f"| `{here}` | {_type(value, schema)} | {default} | {_plain(value.get('description', ''))} |"
        for name, below in _tables(value, schema):
            if name not in above:
                yield from _rows(below, schema, f"{here}{'.*' if _keyed(value) else ''}.", (*above, name))


def _keyed(value: Mapping[str, Any]) -> bool:
    return any("additionalProperties" in one for one in (value, *value.get("anyOf", [])))


def _tables(value: Mapping[str, Any], schema: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Tables that a value may be, lists and keyed tables of them included."""
    if "$ref" in value:
        name = _name_of(value)
        found = schema["$defs"][name]
        if "properties" in found:
            yield name, found
        return
    for one in (*value.get("anyOf", []), *value.get("oneOf", []), value.get("items"), value.get("additionalProperties")):
        if isinstance(one, Mapping):
            yield from _tables(one, schema)


def _type(value: Mapping[str, Any], schema: Mapping[str, Any]) -> str:
    """In words of TOML."""
    if "enum" in value:
        return _plain(", ".join(json.dumps(one) for one in value["enum"]))
    if "const" in value:
        return _plain(json.dumps(value["const"]))
    for kind in ("anyOf", "oneOf"):
        if kind in value:
            return " or ".join(dict.fromkeys(_type(one, schema) for one in value[kind] if one.get("type") != "null"))
    if "$ref" in value:
        found = schema["$defs"][_name_of(value)]
        return "table" if "properties" in found else _type(found, schema)
    return {"array": "list", "object": "table", "string": "text"}.get(str(value.get("type")), str(value.get("type", "any")))


def _short(value: Any) -> str:
    """A default as TOML has it; tables and long lists are left out."""
    text = "" if value is None else json.dumps(value)
    return "" if len(text) > 60 else f"`{text}`" if text else ""


def _plain(text: str) -> str:
    for sign, written in (("|", "\\|"), ("<", "&lt;"), ("{", "&#123;"), ("*", "\\*")):
        text = text.replace(sign, written)
    return re.sub(r"\s+", " ", text).strip()


def code_page(page: CodePage) -> str:
    """The page of a code, as `postproc explain` prints it.

    It stands in no list of contents: 600 of them on each page cost minutes.
    """
    body = page.text().partition("\n")[2].strip("\n")
    return f"---\norphan: true\n---\n# {page.code}\n\n````text\n{body}\n````\n"


def codes_page() -> str:
    """All codes by area."""
    parts = ["# Codes of messages", "", "`postproc explain CODE` prints the same pages.", ""]
    areas: dict[str, list[CodePage]] = {}
    for code, page in pages().items():
        areas.setdefault(code.partition(".")[0], []).append(page)
    for area, some in areas.items():
        parts += [f"## {area}", "", some[0].about, "",
                  *(f"- [{one.code}](codes/{one.code}.md): {_plain((one.messages or ('',))[0])[:140]}" for one in some), ""]
    return "\n".join(parts)
