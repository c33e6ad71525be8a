"""Part, fixtures and table beside cutter, shank and holder: what touches, and by how much (see README.md)."""
