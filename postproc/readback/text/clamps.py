"""Codes of the clamps of rotary axes, which are the builder's."""

from __future__ import annotations

from collections.abc import Mapping

from machines.machine import ClampCodes
from toolpaths.diagnostics import Diagnostic, error


def closing(clamps: Mapping[str, ClampCodes]) -> tuple[float, ...]:
    """M numbers that clamp."""
    return tuple(sorted({float(codes.clamp[1:]) for codes in clamps.values()}))


def opening(clamps: Mapping[str, ClampCodes]) -> tuple[float, ...]:
    """M numbers that release."""
    return tuple(sorted({float(codes.unclamp[1:]) for codes in clamps.values()}))


def clamp_numbers(clamps: Mapping[str, ClampCodes]) -> tuple[float, ...]:
    """All of them."""
    return (*closing(clamps), *opening(clamps))


def two_meanings(clamps: Mapping[str, ClampCodes], own: tuple[float, ...], file: str) -> list[Diagnostic]:
    """Errors for codes of a machine file that are codes of the control (`own`), or clamp one axis and release another."""
    found = []
    for letter, codes in clamps.items():
        for key, code in (("clamp", codes.clamp), ("unclamp", codes.unclamp)):
            if float(code[1:]) in own:
                found.append(error("machine.clamp", f"{key} = {code!r} of axis {letter}: this control has another meaning "
                                   f"for {code}", file=file, hint="the builder's manual names the code: "
                                   f"[axes.{letter}] {key}, or take both out where the machine clamps by itself"))
    both = set(closing(clamps)) & set(opening(clamps))
    if both:
        found.append(error("machine.clamp", f"M{min(both):g} clamps one axis and releases another", file=file,
                           hint="clamp and unclamp of the machine file have codes of their own"))
    return found
