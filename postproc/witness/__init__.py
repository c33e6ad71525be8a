"""A second witness of every program: its own reading of CL file and machine file, nothing of the project's own."""

from __future__ import annotations

from postproc.witness.evidence import Case, Executed, Finding, Testimony

__all__ = ["Case", "Executed", "Finding", "Testimony", "testify"]


def testify(case: Case, executed: Executed) -> Testimony:
    """What a second reading of the CL file and a second kinematics say of an executed program."""
    from postproc.witness.testify import testify as say

    return say(case, executed)
