"""Hints on installed packages whose code is broken: without the package the fault is gone."""

from __future__ import annotations

from tests.hints.case import Edit, HintCase
from tests.hints.convert_cases import CUT, LENGTH, START

INFO = "hint_shop-1.0.dist-info"
POINTS = f"{INFO}/entry_points.txt"
NO_ANGLES = """from postproc.setup.criteria import OrientationCriterion
class Worst(OrientationCriterion):
    def title(self): return "angle"
    def bounds(self): return None
    def angles(self, axes, normal, travel): return axes
"""
BALL = START.replace("LOADTL/1\n", "CUTTER/10,5\nLOADTL/1\n") + CUT + "FINI\n"


def _package(group: str, code: str, **files: str) -> dict[str, str]:
    return {"part.apt": BALL, "s.toml": LENGTH, f"{INFO}/METADATA": "Metadata-Version: 2.1\nName: hint-shop\nVersion: 1.0\n",
            POINTS: f"[postproc.{group}]\nworst = hint_shop_{group}:Worst\n", f"hint_shop_{group}.py": code, **files}


_CONVERT = "convert part.apt -m mill-3axis -c fanuc-30i --setup s.toml -o p.nc"
PACKAGES = [
    HintCase("cl.plug-in", _CONVERT, _package("cl_dialects", "Worst = 7\n"), "uninstall the package hint-shop",
             (Edit(POINTS, "worst = hint_shop_cl_dialects:Worst\n", ""),), packages=True),
    HintCase("report.plug-in", f"{_CONVERT} --report r.html", _package("report_tabs", "Worst = 7\n"),
             "uninstall the package hint-shop", (Edit(POINTS, "worst = hint_shop_report_tabs:Worst\n", ""),),
             packages=True),
    HintCase("orient.criterion", "orient part.apt -m mikron-ucp710 --setup s.toml",
             _package("orientation_criteria", NO_ANGLES, **{"s.toml": LENGTH + "[orientation.criteria.worst]\n"}),
             r"take \[orientation.criteria.worst\] out of the set-up",
             (Edit("s.toml", "[orientation.criteria.worst]\n", ""),),
             packages=True)]
