"""What words mean: interpolation modes, planes, arcs."""
