"""Workers prepare the asserts of a test file one at a time: the second finds on disk what the first has kept there."""

from __future__ import annotations

import fcntl
import os
import sys
import tempfile
from functools import wraps
from importlib.util import source_hash
from pathlib import Path
from typing import Any

import pytest
from _pytest.assertion import rewrite

KNOWN = 9
"""version of pytest; what is changed here are its inner parts"""
LOCK = Path(tempfile.gettempdir()) / f"postproc-tests-rewrite-{os.getuid()}.lock"
_NEEDED = ("_rewrite_test", "_read_pyc", "_write_pyc", "get_cache_dir", "PYC_TAIL", "assertstate_key")


def one_at_a_time(prepare: Any) -> Any:
    """pytest's step from source to code, under a lock of all workers."""

    @wraps(prepare)
    def locked(file: Path, config: Any) -> Any:
        kept = rewrite.get_cache_dir(file) / (file.name[:-3] + rewrite.PYC_TAIL)
        with LOCK.open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            code = rewrite._read_pyc(file, kept)
            if code is not None:
                return source_hash(file.read_bytes()), code
            digest, code = prepare(file, config)
            if kept.parent.is_dir() and not sys.dont_write_bytecode:
                rewrite._write_pyc(config.stash[rewrite.assertstate_key], code, digest, kept)
            return digest, code

    return locked


def install() -> None:
    """For all test files of this process; other versions of pytest than those known here work without."""
    known = pytest.version_tuple[0] == KNOWN and all(hasattr(rewrite, name) for name in _NEEDED)
    if known and not hasattr(rewrite._rewrite_test, "__wrapped__"):
        rewrite._rewrite_test = one_at_a_time(rewrite._rewrite_test)
