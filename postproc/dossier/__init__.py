"""A machine described: as text, as figures for programs, as a page with its drawing, limits, workspace and proofs."""
