"""CL files: reading every dialect, writing generic APT text. README.md tells the journey of a record."""
