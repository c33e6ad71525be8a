"""Coverage-guided fuzzing of one reader (`make fuzz`): python tests/fuzz/run.py TARGET [--seconds 1200] [--findings FOLDER].

Needs atheris (tests/fuzz/requirements.txt). Seeds are the samples; half of the changes know lines, words and numbers
(`mutate.py`). A finding is kept as a file in the folder, its trace is printed, exit code 77; libFuzzer prints rate
and coverage.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / ".venv" / "fuzz")]
LONGEST_INPUT = 4096
SLOWEST = 60
"""s that one input may take"""


def main() -> None:
    """Never returns: libFuzzer ends the process."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("target")
    options.add_argument("--seconds", type=int, default=1200)
    options.add_argument("--findings", default="out/fuzz")
    given = options.parse_args()
    import atheris

    with atheris.instrument_imports(include=["toolpaths", "machines", "postproc"]):
        from tests.fuzz.mutate import mutated
        from tests.fuzz.targets import seeds, targets

        target = targets()[given.target]

    def custom(data: bytes, most: int, seed: int) -> bytes:
        """Half by lines and numbers, half by bytes."""
        return mutated(data, most, seed) if seed % 2 else atheris.Mutate(data, most)

    findings = Path(given.findings)
    findings.mkdir(parents=True, exist_ok=True)
    corpus = findings / "corpus" / given.target  # kept: the next run goes on from there
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds(given.target)):
        (corpus / f"seed{number}").write_bytes(seed[:LONGEST_INPUT])
    atheris.Setup([sys.argv[0], f"-max_total_time={given.seconds}", f"-max_len={LONGEST_INPUT}", f"-timeout={SLOWEST}",
                   f"-artifact_prefix={findings}/{given.target}-", "-rss_limit_mb=3000", "-print_final_stats=1",
                   str(corpus)], target, custom_mutator=custom)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
