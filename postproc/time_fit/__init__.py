"""The model of a control fitted to measured runs: logs, totals, kinds of motion that a run does not hold."""
