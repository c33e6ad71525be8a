"""CL files: reading every dialect, writing generic APT text. README.md says the journey of a record."""
