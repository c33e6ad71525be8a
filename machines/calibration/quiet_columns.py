"""Columns of readings that leave far less than their stated noise while the table as a whole leaves what it should.

A column written under too small a unit (arcsec under [urad]) has small errors, and among five others its small residuals
are lost in what all leave together; alone they are not.
"""

from __future__ import annotations

from collections.abc import Sequence

from machines.calibration.noise import CHANCE, Noise, noise_of
from machines.calibration.outcome import FEW, SILENT
from machines.calibration.problem import CalibrationResult
from machines.calibration.run import CalibrationRun
from machines.geometric_error.tables.csv_table import other_units
from toolpaths.arrays import Bools, Floats, Ints

ACCEPT = "where it is read so much finer, accept_residual = true at the top of the file, or --accept-residual"


def quiet_columns(run: CalibrationRun, result: CalibrationResult, sigma: Floats, column: Ints, names: Sequence[str],
                  units: Sequence[str]) -> None:
    """Report columns whose size a wrong unit explains; nothing where the readings as a whole miss their noise, which is
    reported as such.

    Args:
        sigma, column: (R,) stated standard deviation of each reading, and which of `names` it is of
        names, units: of the C columns
    """
    if len(names) < 2 or result.noise is None or not result.noise.meets:
        return
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        noise = _noise_of_column(result, sigma, column == k)
        if noise is None or noise.freedom < FEW or noise.left >= SILENT or noise.less > CHANCE / len(names):
            continue
        message = (f"what is left of {name} is {noise.left:.3g} times its stated standard deviation, of all readings "
                   f"{result.noise.left:.3g} times")
        explained = [other for other, size in other_units(unit).items() if noise.scaled(size).meets]
        if explained and not run.checked.accept_residual:
            run.problem("calibrate.slip", message, f"with {name} in {' or '.join(explained)} (write [{explained[0]}] in the "
                        f"header) its stated noise would be left; {ACCEPT}")
        else:
            run.warn("calibrate.silent", message, f"look at the unit of {name}")


def _noise_of_column(result: CalibrationResult, sigma: Floats, of: Bools) -> Noise | None:
    """What a column leaves; the fit takes as many degrees of freedom of it as its readings have leverage."""
    weighted = result.residuals[of] / sigma[of]
    return noise_of(weighted, float(result.leverage[of].sum()), bool((result.weights < 1.0).any()))
