"""What the commands on error models share: reading one, options AXIS=NUMBER, writing models with their tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from postproc.cli.shared.console import report, shown_errors

if TYPE_CHECKING:
    from machines.geometric_error.actual.model import ErrorModel
    from machines.machine import Machine
    from toolpaths.diagnostics import Diagnostic

T = TypeVar("T")
PLACES = ("--at", "--zero")
"""options whose numbers are positions; those of others are sizes, more than 0"""


def loaded(file: Path, machine: Machine) -> tuple[ErrorModel, list[Diagnostic]]:
    """The model of a file, and warnings.

    Raises:
        DiagnosticError: where the file has errors.
    """
    from machines.geometric_error.files.loader import load_checked

    model, found = load_checked(file, machine)
    return required(model, found), found


def required(model: ErrorModel | None, found: Sequence[Diagnostic]) -> ErrorModel:
    """The model.

    Raises:
        DiagnosticError: where there is none.
    """
    from toolpaths.diagnostics import DiagnosticError

    if model is None:
        raise DiagnosticError(found)
    return model


def or_refused(made: Callable[[], T], file: Path) -> T:
    """What `made` gives.

    Raises:
        DiagnosticError: for its ValueError, which says why it cannot be had.
    """
    from toolpaths.diagnostics import DiagnosticError, error

    try:
        return made()
    except ValueError as fault:
        raise DiagnosticError([error("error-export.refused", str(fault), file=str(file))]) from fault


def pairs(option: str, given: Sequence[str] | None, known: Sequence[str]) -> dict[str, float]:
    """AXIS=NUMBER as a table.

    Raises:
        typer.BadParameter: says what there is to choose from.
    """
    found: dict[str, float] = {}
    for text in given or ():
        letter, _, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        wrong = not (-1e9 < value < 1e9) or (option not in PLACES and value <= 0.0)
        if letter not in known or letter in found or wrong:
            raise typer.BadParameter(f"{text!r}: write AXIS=NUMBER, each of {', '.join(known)} at most once"
                                     + ("" if option in PLACES else ", more than 0"), param_hint=option)
        found[letter] = value
    return found


def writable(model: ErrorModel, made: ErrorModel) -> tuple[ErrorModel, list[str]]:
    """A model made of another one, with a covariance that a table can hold, and what that loses."""
    from machines.geometric_error.exchange.exports import MOST_UNCERTAINTY, correlated

    if model.covariance is None:
        return made, []
    if made.covariance is not None and (len(made.names) <= MOST_UNCERTAINTY or not correlated(made)):
        return made, ["covariance kept"]
    return replace(made, covariance=None), [f"lost: the covariance; {len(made.names)} correlated parameters, at most "
                                            f"{MOST_UNCERTAINTY} are written: take longer steps or greater losses"]


def model_files(model: ErrorModel, stem: str, description: str, name: str = "") -> dict[str, str]:
    """File name -> text, the tables first, the model, called `name`, last."""
    from machines.geometric_error.exchange.write_model import write_model

    files = write_model(replace(model, name=stem), description)
    text = files.pop(f"{stem}.toml")
    return files | {name or f"{stem}.toml": text}


def doubted(model: ErrorModel) -> int:
    """Parameters that the covariance says anything of."""
    return 0 if model.covariance is None else int((model.covariance.diagonal() > 0.0).sum())


def merged_into(model: ErrorModel, into: Path, machine: Machine) -> tuple[ErrorModel, list[str]]:
    """A model with the errors of another one put in or replaced, and what that loses.

    Raises:
        DiagnosticError: where the file has errors, or either is a map.
    """
    from machines.geometric_error.exchange.tabulate import merged, replaced
    from toolpaths.diagnostics import DiagnosticError, error

    old, _ = loaded(into, machine)
    if old.map is not None or model.map is not None:
        raise DiagnosticError([error("error-import.map", "a map cannot be combined with other sources", file=str(into),
                                      hint="leave --into out")])
    lost = replaced(old, model) if old.covariance is not None and model.covariance is None else set()
    names = sorted({name.split("[")[0].split(".")[0] for name in lost})
    noted = [f"uncertainty unknown of {', '.join(names)}: give --covariance, or sigma in the model"] if names else []
    return merged(old, model), noted


def tables_of(file: Path) -> list[Path]:
    """CSV tables that a model file names."""
    from machines.user_file import read_toml

    found, _ = read_toml(file, None, "error model")
    if found is None:
        return []
    groups = [*found.values.get("components", {}).values(), found.values.get("map", {}), found.values.get("covariance", {})]
    return [file.parent / g["table"] for g in groups if isinstance(g, dict) and isinstance(g.get("table"), str)]


def finish(files: dict[str, str], folder: Path, inputs: Sequence[Path], json: str, found: Sequence[Diagnostic],
           noted: Sequence[str], figures: dict[str, Any], adjacent: dict[Path, str] | None = None) -> None:
    """Write all files together, none where one would replace an input; report them."""
    from postproc.cli.error_text import export_text
    from toolpaths.diagnostics import DiagnosticError, error
    from toolpaths.input_files import place

    last = sorted(files, key=lambda name: name.endswith(".toml"))  # a model is there when its tables are
    outputs: dict[Path, str | bytes] = {**{folder / name: files[name] for name in last}, **(adjacent or {})}
    known = {place(path) for given in inputs for path in (given, *(tables_of(given) if given.suffix == ".toml" else []))}
    with shown_errors(json):
        for path in outputs:
            if place(path) in known:
                raise DiagnosticError([error("error-export.input", "the output would replace an input", file=str(path),
                                             hint="write into another folder, or under another name")])
    values = {"files": [str(path) for path in outputs], "told": list(noted), **figures,
              "diagnostics": [d.as_dict() for d in found]}
    report(tuple(found), json, values, export_text(values), outputs)
