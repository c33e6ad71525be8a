"""The report: one page that opens offline, and the same content as JSON."""
