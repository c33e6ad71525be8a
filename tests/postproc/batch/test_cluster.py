"""One search on several workers: what it finds is what one process finds, whichever way they begin and whoever is killed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from postproc.base.options import Options
from postproc.base.team import Processes, StartMethod, Team, team_at_hand, working
from postproc.batch.cluster import Cluster, spread
from postproc.batch.run import Where
from postproc.cli.app import app
from postproc.orientation.passes import parallel_map
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.parallel_map import each_pass
from postproc.orientation.passes.passes import PassContext, work_of
from postproc.placement.place import place
from postproc.setup.model import SetupFile, load_setup
from tests.postproc.batch.cluster_kit import line_of, refuses, squared, without_processes
from tests.postproc.kit import SAMPLES, machine, toolpath
from toolpaths import read

SQUARES = [3 * k * k for k in range(12)]


def twelve_passes() -> PassContext:
    """Twelve short cuts next to each other."""
    lines = [line for k in range(12) for line in ("RAPID", f"GOTO/0,{k},20", f"GOTO/0,{k},0", f"GOTO/9,{k},0", "RAPID",
                                                  f"GOTO/9,{k},20")]
    head = ["UNITS/MM", "CUTTER/10,5", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,900"]
    made, _ = work_of(toolpath(*lines, head=head), machine("mikron-ucp710"), SetupFile(), Options())
    assert made is not None and len(made.passes) == 12
    return made


def found(team: Team, mark: Path | None) -> list[int]:
    crew = team.crew(squared, (3, "" if mark is None else str(mark)))
    try:
        return list(crew.results(range(12)))
    finally:
        crew.close()


@pytest.mark.parametrize("method", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_processes_find_the_same_and_one_that_is_killed_is_replaced(method: StartMethod, tmp_path: Path) -> None:
    """Spawned ones get what is shared packed; what a killed process leaves this one does."""
    assert found(Processes(2, method), None) == SQUARES
    mark = tmp_path / "killed"
    mark.write_text("here", encoding="utf-8")  # this process is not killed where it does what is left
    assert found(Processes(2, method), mark) == SQUARES
    with pytest.raises(ArithmeticError, match="no 1 0"):
        list(Processes(2, method).crew(refuses, 1).results(range(3)))


def test_a_pool_whose_process_was_killed_is_ended_by_this_process(tmp_path: Path) -> None:
    mark = tmp_path / "killed"
    assert found(Processes(2, "fork"), mark) == SQUARES
    assert int(mark.read_text("utf-8")) != os.getpid()


@contextmanager
def two_workers() -> Iterator[None]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", silence_logs=50,
                                  dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False}) as cluster, \
            spread(Where(scheduler=cluster.scheduler_address)):
        assert isinstance(team_at_hand(), Cluster)
        yield
    assert team_at_hand() is None


def test_a_worker_of_a_cluster_killed_in_the_middle_of_a_pass_is_replaced(tmp_path: Path,
                                                                          monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel_map, "CHUNK", 2)
    monkeypatch.setattr(parallel_map, "_FEWEST", 2)
    here, mark = twelve_passes(), tmp_path / "killed"
    with two_workers():
        team = team_at_hand()
        assert team is not None and list(team.crew(without_processes, 0).results([1])) == [True], "of a batch's worker"
        lines = each_pass(partial(line_of, here, str(mark)), here, AllowedAxes(1.0), "trying")
    assert lines == [one.line for one in here.passes] and int(mark.read_text("utf-8")) != os.getpid()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "file"), [("mikron-ucp710", "mill"), ("uranesx", "delta")])
def test_workers_look_at_places_as_one_process_does(name: str, file: str) -> None:
    """Forked, spawned and on a cluster: each place is timed to the last digit as one process has it, and as often."""
    file = str(SAMPLES / "placement" / f"{file}.setup.toml")
    (setup, _), path, options = load_setup(file), read(SAMPLES / "test_part.cls")[0], Options(setup=file)
    teams = (nullcontext(), working(Processes(2, "fork")), working(Processes(2, "spawn")), two_workers())
    made = []
    for team in teams:
        with team:
            made.append(place(path, machines.load(name), setup, options)[0])
    alone = made[0]
    assert alone is not None and len(alone.known) > 20
    for other in made[1:]:
        assert other is not None and np.array_equal(other.best.place, alone.best.place)
        assert (other.looked, other.planned, other.pruned) == (alone.looked, alone.planned, alone.pruned)
        assert [(p.seconds, p.bound, p.limiting) for p in other.known] == [(p.seconds, p.bound, p.limiting)
                                                                           for p in alone.known]


def test_a_scheduler_that_is_not_there_is_named() -> None:
    pytest.importorskip("distributed")
    done = CliRunner().invoke(app, ["orient", str(SAMPLES / "test_part.cls"), "-m", "mikron-ucp710", "--scheduler",
                                    "nowhere"])
    assert done.exit_code == 1 and "[batch.scheduler] no scheduler answers at nowhere" in done.output
