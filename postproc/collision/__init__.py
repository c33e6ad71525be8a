"""Part, fixtures and table next to cutter, shank and holder: what touches, and by how much (see README.md)."""
