"""What every model of a user's file is made of, and the JSON schema of such a file.

The text of a key stands below it in the source. It is read when a schema or a message asks for it, not when the model
is made: commands that print neither do without.
"""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from pathlib import Path
from typing import Any, Self, Union

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, TypeAdapter
from pydantic_core import CoreSchema

DRAFT = "https://json-schema.org/draft/2020-12/schema"
SCHEMA_KEY = "$schema"
"""key at the top of a file that names its schema for an editor; it says nothing of what the file describes"""


class UserModel(BaseModel):
    """Base of every model of a user's file: frozen, no unknown key, no conversion between types, no inf or nan."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False,
                              defer_build=True)

    @classmethod
    def unstated(cls) -> Self:
        """As it is where a file states none of its keys. Nothing is checked, so nothing that checks is built."""
        return cls.model_construct()

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The schema with the text of each key."""
        result = handler(core_schema)
        inner = handler.resolve_ref_schema(result)
        for key, text in key_texts(cls).items():
            if key in inner.get("properties", {}):
                inner["properties"][key].setdefault("description", text)
        return result


def key_texts(model: type[BaseModel]) -> dict[str, str]:
    """The text of each key of a model, those that it inherits included; keys without one are left out."""
    own = [_texts_of(one) for one in reversed(model.__mro__) if issubclass(one, BaseModel)]
    names = {field: info.alias or field for field, info in model.model_fields.items()}
    stated = {field: info.description for field, info in model.model_fields.items() if info.description}
    return {names[field]: text for texts in (*own, stated) for field, text in texts.items() if field in names}


@cache
def _texts_of(model: type) -> dict[str, str]:
    """By field: the text below it in the source of its class."""
    found = _classes(model.__module__).get(model.__qualname__)
    if found is None:
        return {}
    pairs = zip(found.body, found.body[1:], strict=False)
    return {field.target.id: inspect.cleandoc(text.value.value) for field, text in pairs
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant) and isinstance(text.value.value, str)}


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """The classes of a module by their qualified names; none where its source is not at hand."""
    file = getattr(sys.modules.get(module), "__file__", None)
    try:
        tree = ast.parse(Path(file or "").read_bytes())
    except (OSError, ValueError, SyntaxError):
        return {}
    found: dict[str, ast.ClassDef] = {}
    todo: list[tuple[str, ast.AST]] = [("", tree)]
    while todo:
        above, node = todo.pop()
        for one in ast.iter_child_nodes(node):
            if isinstance(one, ast.ClassDef):
                found[above + one.name] = one
                todo.append((f"{above}{one.name}.", one))
            elif isinstance(one, ast.FunctionDef):
                todo.append((f"{above}{one.name}.<locals>.", one))
    return found


def schema(kind: str, *models: type[BaseModel]) -> dict[str, Any]:
    """The JSON schema of a user's file of a kind that is any of the models, with the keys that `read_toml` takes out.

    It holds for a file with its base merged in: a file that names a base may leave out what that gives.
    """
    any_of: Any = Union[models]  # noqa: UP007  # of as many as are given
    result: dict[str, Any] = TypeAdapter(any_of).json_schema()
    texts = {SCHEMA_KEY: "this schema, for editors that check a file while it is written",
             "base": "built-in file (or .toml file next to this one) whose values hold where this file gives none"}
    taken_out = {key: {"type": "string", "description": text} for key, text in texts.items()}
    several = [result["$defs"][choice["$ref"].split("/")[-1]] for choice in result.get("anyOf", [])]
    for top in several or [result]:
        top["properties"] = taken_out | top.get("properties", {})
    return {SCHEMA_KEY: DRAFT, "$id": f"urn:postproc:schema:{kind}:1"} | result
