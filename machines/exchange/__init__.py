"""Machine files of others read as ours, and ours written for LinuxCNC (README.md)."""
