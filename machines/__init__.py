"""What a machine can do: kinematics, limits, machine files."""
