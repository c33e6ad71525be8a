"""Hints on certificates of workspaces."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase

_ANOTHER = '{"certificate": 1, "machine": "uranesx"}'
DESIGN = [
    HintCase("certificate.turns", "machine certify mikron-ucp710 --turn A=-90:0", {},
             "a range inside the travel with (--turn)", (Edit(COMMAND, "-90:0", "-20:0"),)),
    HintCase("certificate.box", "machine certify mikron-ucp710 --box 700x700x700", {}, "ask for a smaller (--box)",
             (Edit(COMMAND, "700x700x700", "100x100x100"),)),
    HintCase("design.cranks", "machine design --layout rotary-delta --box 1x1x100 --arm 50 --rod 480", {},
             "take an (arm) longer than the height", (Edit(COMMAND, "--arm 50", r"--\1 260"),)),
    HintCase("analysis.reach", "machine analyse uranesx --map speed --along rod=100:200", {},
             "sizes with (--along rod)=LOW:HIGH", (Edit(COMMAND, "--along rod=100:200", r"\1=1200:1400"),)),
    HintCase("repeatability.column", "errors repeatability r.csv", {"r.csv": "reading\n1\n2\n"},
             r"write (reading \[arcsec\])", (Edit("r.csv", "reading", r"\1"),)),
    HintCase("repeatability.approach", "errors repeatability r.csv", {"r.csv": "reading [um],approach\n1,2\n3,1\n2,1\n"},
             "write (1) where the axis came from lesser values", (Edit("r.csv", "1,2", r"1,\1"),)),
    HintCase("repeatability.few", "errors repeatability r.csv", {"r.csv": "reading [um],position [mm]\n1,0\n3,0\n2,5\n"},
             "or leave it out", (Edit("r.csv", "2,5\n", ""),)),
    HintCase("certificate.head", "machine certify h4a-spindle-axis --box=-5:5,-5:5,-650:-640", {},
             "leave (--box) out", (Edit(COMMAND, " --box=-5:5,-5:5,-650:-640", ""),)),
    HintCase("certificate.short", "machine certify uranesx --box=-250:900,-250:250,-250:250 --margin 0.3", {},
             "make the workspace or (--box) smaller", (Edit(COMMAND, "-250:900", "-250:250"),)),
    HintCase("certificate.undecided", "machine certify uranesx --margin 0.3836634533", {},
             "ask for a smaller (--margin)", (Edit(COMMAND, "0.3836634533", "0.3"),)),
    HintCase("certificate.file", "machine certify --check c.json", {"c.json": "{}"},
             "write one with postproc (machine certify) NAME -o CERT.json",
             (Edit(COMMAND, "machine certify --check c.json", r"\1 uranesx --box=-9:9,-9:9,-209:-200 -o c.json"),)),
    HintCase("dynamics.missing", "machine forces m.toml", {"m.toml": 'base = "mill-3axis"\n'},
             r"add (\[dynamics)\], with \[dynamics(\.axes\.)LETTER\] for each axis: (mass), (force)",
             (Edit("m.toml", "", r"\1\2Z]\n\3 = 40\n\4 = 900\n"),)),
    HintCase("dynamics.reach", "machine forces m.toml --tip 2000,0,0", {
        "m.toml": 'base = "uranesx"\n[dynamics.axes.Z]\nmass = 40\n'}, "a place inside with (--tip)",
             (Edit(COMMAND, "2000,0,0", "0,0,-100"),)),
    HintCase("analysis.map", "machine analyse mill-3axis --map speed", {}, "leave (--map) out",
             (Edit(COMMAND, " --map speed", ""),)),
    HintCase("analysis.map", "machine analyse tricept --map speed", {}, "leave (--map) out",
             (Edit(COMMAND, " --map speed", ""),)),
    HintCase("analysis.map", "machine analyse mill-3axis --figure m.svg", {}, "leave (--figure) out",
             (Edit(COMMAND, " --figure m.svg", ""),)),
    HintCase("design.none", "machine design --box 100x100x10 --max bulk=20 -o d.toml", {}, "loosen (--max)",
             (Edit(COMMAND, "bulk=20", "bulk=2000"),)),
    HintCase("sensitivity.legs", "machine stiffness mill-3axis --rod 1", {}, "name a machine (on legs)",
             (Edit(COMMAND, "mill-3axis", "planar-delta"),)),
    HintCase("sensitivity.adjust", "machine tolerance mill-3axis --adjust", {}, "leave (--adjust) out",
             (Edit(COMMAND, " --adjust", ""),)),
    HintCase("sensitivity.cost", "machine tolerance mill-3axis --error 0.02 --cost axes=3", {}, "did you mean '(axis)'",
             (Edit(COMMAND, "axes=3", "axis=3"),)),
    HintCase("certificate.machine", "machine certify --check c.json", {"c.json": _ANOTHER.replace("uranesx", "none.toml")},
             "name it: postproc machine certify MACHINE.toml --check", (Edit(COMMAND, "certify", "certify uranesx"),),
             stops=("certificate.rejected",)),
    HintCase("certificate.rejected", "machine certify --check c.json", {"c.json": _ANOTHER},
             r"certify again: postproc (machine certify uranesx -o c\.json)",
             (Edit(COMMAND, "machine certify --check c.json", r"\1"),)),
]
"""the margin that is not decided is the least singular value at the corners of the workspace, but for its last digits"""
