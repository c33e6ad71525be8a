"""Options, version, memory, compiled loops."""
