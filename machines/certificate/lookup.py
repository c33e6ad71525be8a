"""Which certificate goes with a machine file: by the hash of what the proof rests on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

SHIPPED = Path(__file__).parent / "shipped"
NEXT_TO_IT = ".certificate.json"
"""what the name of a certificate next to a machine file ends in"""
APART = ("clearance", "assumed", "source", "family")
"""keys of `[kinematics]` that the proof does not rest on"""
CHAIN = "structure"
"""key of a chain of axes, of which a box of tips inside its travel is proved: its travel counts too"""
DISTANCES = ("direct", "inverse", "held")
"""bounds that the margin is of"""
WHOLE = "workspace"
"""what a certificate of the whole declared workspace covers"""


def key_of(values: Mapping[str, Any]) -> str:
    """The hash of a machine file's merged values."""
    kinematics = values.get("kinematics", {})
    table = {"kind": kinematics.get("family")} | {k: v for k, v in kinematics.items() if k not in APART}
    if CHAIN in table:
        table["travel"] = {letter: axis.get("travel", "") for letter, axis in values.get("axes", {}).items()}
    text = json.dumps(_plain(table), sort_keys=True, separators=(",", ":"))
    return sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Numbers as floats, so that 700 and 700.0 are one."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


@cache
def shipped() -> Mapping[str, Path]:
    """The certificates that come with the package, by key."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.json"))}


def certificate_of(values: Mapping[str, Any], file: str) -> Path | None:
    """The certificate of the whole declared workspace of a machine file of these values: shipped, or next to the file."""
    key = key_of(values)
    if (found := shipped().get(key)) is not None:
        return found
    own = Path(file).with_suffix(NEXT_TO_IT) if file else None
    return own if own is not None and _is_whole(own, key) else None


def comes_with_package(file: str) -> bool:
    """True of a certificate that the project's own check has confirmed; any other is a claim until it is checked."""
    return bool(file) and Path(file).parent == SHIPPED


def _is_whole(file: Path, key: str) -> bool:
    """True of the whole, unchanged certificate with that key, of a workspace or of a box of a chain: nobody has edited its
    boxes or its margin."""
    try:
        found = json.loads(file.read_text("utf-8")) if file.is_file() else None
        if not isinstance(found, dict) or found["key"] != key or not _unchanged(found):
            return False
        least = found["proved"]
        if "chain" in found:
            return bool(min(float(v) for v in least.values()) >= 0.0)
        proved = min(float(least[name]) for name in DISTANCES)
        return bool(found["covers"] == WHOLE and 0.0 < float(found["margin"]) <= proved)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError):
        return False


def _unchanged(found: Mapping[str, Any]) -> bool:
    return bool(found["digest"] == sha256("\n".join(found["boxes"]).encode()).hexdigest())
