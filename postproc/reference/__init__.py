"""Records spelt out: events, moves, holes, tools, coolant."""
