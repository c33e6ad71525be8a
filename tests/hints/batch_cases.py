"""Hints on the file of a batch and on its workers."""

from __future__ import annotations

from tests.hints.case import COMMAND, Edit, HintCase

JOBS = """output = "out"
machines = ["mill-3axis"]
controllers = ["linuxcnc"]
[options]
tolerance = 0.02
[[jobs]]
command = "inspect"
files = ["part.apt"]
"""
PART = "UNITS/MM\nLOADTL/1\nFROM/0,0,50\nRAPID\nGOTO/0,0,5\nFINI\n"


def _batch(code: str, jobs: str, says: str, *does: Edit, words: str = "", **files: str) -> HintCase:
    given = {name.replace("_", "."): text for name, text in files.items()}
    return HintCase(code, f"batch jobs.toml{words}", {"jobs.toml": jobs, "part.apt": PART, **given}, says, does)


BATCH = [
    _batch("file.missing-key", JOBS.partition("[[jobs]]")[0], r"add a table (\[\[jobs\]\]) with (files = \[)\.\.\.\]",
           Edit("jobs.toml", "", '\n\\1\ncommand = "inspect"\n\\2"part.apt"]\n')),
    _batch("batch.option", JOBS.replace("tolerance", "tolerans"), "did you mean '(tolerance)'",
           Edit("jobs.toml", "tolerans", r"\1")),
    _batch("batch.no_file", JOBS.replace("part.apt", "prat.apt"), r"(\*) stands for any part",
           Edit("jobs.toml", "prat.apt", r"\1.apt")),
    _batch("batch.same_name", JOBS + 'name = "a"\n[[jobs]]\nname = "a"\ncommand = "inspect"\nfiles = ["part.apt"]\n',
           "a name of its own, or none", Edit("jobs.toml", 'name = "a"\n[[jobs]]', "[[jobs]]")),
    _batch("batch.nothing_stated", JOBS.replace('machines = ["mill-3axis"]\n', "").replace('command = "inspect"', (
        'command = "time"')).replace("part.apt", "p.nc"), r"add (machines = \[)",
        Edit("jobs.toml", "[options]", '\\1"mill-3axis"]\n[options]'),
           p_nc="G21 G90 G17 G40 G49 G80 G94 G98 G54\nG53 G0 Z0\nM2\n"),
    _batch("batch.same_output", JOBS.replace('"part.apt"', '"part.apt", "part.cls"'), "jobs with names of their own",
           Edit("jobs.toml", '"part.apt", "part.cls"]', '"part.apt"]\nname = "a"\n[[jobs]]\nname = "b"\n'
                'command = "inspect"\nfiles = ["part.cls"]'), part_cls=PART),
    _batch("batch.wrong_use", JOBS.replace('"inspect"', '"orient"').replace("0.02", "20"), "(--help) lists",
           Edit("jobs.toml", 'command = "orient"', 'command = "inspect"'), Edit("jobs.toml", "= 20", "= 2.0")),
    _batch("batch.scheduler", JOBS, "without (--scheduler)", Edit(COMMAND, " --scheduler nowhere", ""),
           words=" --scheduler nowhere"),
]
