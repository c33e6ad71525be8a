"""The planned motion: least time along a fixed path under velocity, acceleration and jerk. See README.md."""
