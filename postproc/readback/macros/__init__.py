"""Macro language executed: variables, jumps, loops and subprograms of a control, as plain blocks."""
