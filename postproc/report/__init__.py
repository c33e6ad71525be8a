"""Summary, trace, residual field."""
