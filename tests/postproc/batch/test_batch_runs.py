"""A batch goes on where it was: what is done is kept, what has changed is done again, a killed worker costs nothing."""

from __future__ import annotations

import csv
import io
import json
import socket
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest
from typer.testing import CliRunner

import postproc.cli.app as command
from postproc.batch.index import as_csv, as_page, rows_of
from postproc.batch.receipts import Receipt, kept
from postproc.batch.run import Ran, Where, runs
from postproc.cli.app import app
from postproc.cli.batch import _swept
from postproc.cli.shared.group import only_called
from tests.postproc.batch.batch_kit import (
    JOBS,
    batch_folder,
    counted_run,
    killed_always,
    killed_once,
    planned,
    with_keys,
)
from toolpaths.diagnostics import DiagnosticError, error


def _batch(jobs: Path, *words: str) -> tuple[int, str, dict[str, object]]:
    arguments = ["batch", str(jobs), *words]
    ran = CliRunner().invoke(only_called(app, arguments), arguments)  # as the command line does
    index = jobs.parent / "out" / "index.json"
    return ran.exit_code, ran.output, json.loads(index.read_text("utf-8")) if index.exists() else {}


def _begun(jobs: Path) -> Counter[str]:
    file = jobs.parent / "out" / "begun.txt"
    return Counter(file.read_text("utf-8").split()) if file.exists() else Counter()


def test_a_batch_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "run_command", counted_run)
    jobs = batch_folder(tmp_path)
    (tmp_path / "part3.cls").write_text("LOADTL/9\nNONSENSE/1\n", encoding="utf-8")
    code, said, index = _batch(jobs)
    assert code == 1 and "3 runs: 2 done, 1 refused" in said and "part3.cls" in said
    assert [row["outcome"] for row in index["runs"]] == ["done", "done", "refused"]
    assert index["ok"] is False and index["schema_version"] == 1
    programs = {file.name: file.read_bytes() for file in (tmp_path / "out").glob("*.ngc")}
    assert set(programs) == {"part1.ngc", "part2.ngc"}
    assert _begun(jobs) == Counter(part1=1, part2=1, part3=1)

    assert _batch(jobs)[1].startswith("3 runs: 2 done, 1 refused; 3 of them were done before")
    assert _begun(jobs).total() == 3, "nothing has changed: nothing is run"

    (tmp_path / "out" / "part1.ngc").write_text("edited by hand", encoding="utf-8")
    (tmp_path / "out" / "part2.json").unlink()
    _batch(jobs)
    assert _begun(jobs) == Counter(part1=2, part2=2, part3=1), "what does not stand as it was written is written again"
    assert {file.name: file.read_bytes() for file in (tmp_path / "out").glob("*.ngc")} == programs

    (tmp_path / "part3.cls").write_text((tmp_path / "part2.cls").read_text("utf-8"), encoding="utf-8")
    code, _, index = _batch(jobs)
    assert code == 0 and index["ok"] is True and _begun(jobs)["part3"] == 2 and _begun(jobs).total() == 6
    _batch(jobs, "--again")
    assert _begun(jobs).total() == 9


def test_wrong_use_and_faults_stop_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code, said, _ = _batch(batch_folder(tmp_path, JOBS + '[jobs.options]\ntolerance = "fast"\n'))
    assert code == 1 and "batch.wrong_use" in said and "--tolerance" in said and not (tmp_path / "out").exists()

    def faulty(arguments: list[str]) -> Ran:
        return Ran(70, ("internal error [x]",)) if "part1" in arguments[1] else counted_run(arguments)

    monkeypatch.setattr(command, "run_command", faulty)
    jobs = batch_folder(tmp_path)
    code, _, index = _batch(jobs)
    assert code == 1 and [row["outcome"] for row in index["runs"]] == ["fault", "done", "done"]
    monkeypatch.setattr(command, "run_command", counted_run)
    assert _batch(jobs)[0] == 0, "a fault is tried again"


def test_an_interrupted_batch_says_what_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(arguments: list[str]) -> object:
        if "part2" in arguments[1]:
            raise KeyboardInterrupt
        return counted_run(arguments)

    monkeypatch.setattr(command, "run_command", interrupted)
    jobs = batch_folder(tmp_path)
    code, said, index = _batch(jobs)
    assert code == 130 and [row["outcome"] for row in index["runs"]] == ["done", "not run", "not run"], said
    monkeypatch.setattr(command, "run_command", counted_run)
    assert _batch(jobs)[0] == 0 and _begun(jobs) == Counter(part1=1, part2=1, part3=1)


@pytest.mark.slow
def test_a_worker_killed_with_half_written_files_loses_nothing(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    jobs = batch_folder(tmp_path, parts=4)
    tasks = with_keys(jobs)
    receipts = dict(runs(tasks, killed_once, Where(2)))
    assert [receipts[k].outcome for k in range(4)] == ["done"] * 4
    assert (tmp_path / "out" / "killed.txt").exists()
    begun = _begun(jobs)
    assert begun["part2"] == 2, "killed, and done by another worker"
    assert all(begun[f"part{k}"] == 1 for k in (1, 3, 4)), "nothing else is done twice"
    _swept([task for task, _ in tasks])
    assert not list((tmp_path / "out").glob(".*postproc-*")), "no temporaries"
    assert all(kept(task, key) == receipts[k] for k, (task, key) in enumerate(tasks))
    made = {k: (tmp_path / "out" / f"part{k}.ngc").read_bytes() for k in (1, 2, 3, 4)}
    for task, _ in tasks:
        counted_run(task.arguments())
    assert made == {k: (tmp_path / "out" / f"part{k}.ngc").read_bytes() for k in (1, 2, 3, 4)}, "the same without workers"


@pytest.mark.slow
def test_what_ends_every_worker_is_lost_alone(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    tasks = with_keys(batch_folder(tmp_path, parts=3))
    with socket.socket() as other:
        with suppress(OSError):  # another batch or another program has Dask's usual port, if not this test
            other.bind(("127.0.0.1", 8787))
            other.listen()
        receipts = dict(runs(tasks, killed_always, Where(2)))
    assert [receipts[k].outcome for k in range(3)] == ["done", "lost", "done"]
    assert "workers ended" in receipts[1].messages[0]


def test_no_more_workers_begin_than_there_are_tasks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def begun(where: Where, stack: object) -> object:
        raise DiagnosticError([error("batch.no_worker", f"{where.workers} workers")])

    pytest.importorskip("distributed")
    monkeypatch.setattr("postproc.batch.run.client_of", begun)
    for parts, asked, said in ((1, 64, "1 workers"), (3, 2, "2 workers")):
        folder = tmp_path / str(parts)
        folder.mkdir()
        with pytest.raises(DiagnosticError, match=said):
            list(runs(with_keys(batch_folder(folder, parts=parts)), counted_run, Where(asked)))


def test_a_scheduler_that_does_not_answer_is_named() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(DiagnosticError, match=r"batch\.scheduler.*nowhere"):
        list(runs([], counted_run, Where(scheduler="nowhere")))


def test_texts_of_files_do_no_harm_in_the_index(tmp_path: Path) -> None:
    (tmp_path / "<b>&.cls").write_text("FINI\n", encoding="utf-8")
    tasks, _ = planned(batch_folder(tmp_path, JOBS + 'name = "<script>"\n', parts=0))
    receipt = Receipt("k", "refused", messages=("=HYPERLINK(1)", "<img>"))
    rows = rows_of(tasks, [receipt], [False], tmp_path / "out")
    page = as_page(rows, "<t>")
    assert "<script>" not in page and "<img>" not in page and "<b>" not in page and "&lt;script&gt;" in page
    cells = next(iter(csv.DictReader(io.StringIO(as_csv([{**rows[0], "job": "=1+1"}])))))
    assert cells["job"] == "'=1+1" and cells["messages"].startswith("'=HYPERLINK") and cells["outcome"] == "refused"


def test_commands_in_threads_of_one_worker_keep_their_messages_apart(tmp_path: Path) -> None:
    """A worker that is begun without --nthreads 1 has a thread for each core; streams are the process's."""
    def said(number: int) -> Ran:
        return command.run_command(["inspect", str(tmp_path / f"{number}.cls")])

    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(said, range(12)))
    for number, ran in enumerate(found):
        assert ran.code == 1 and len(ran.said) == 1 and f"{number}.cls" in ran.said[0], (number, ran)
