"""One TOML file and one small class per controller."""
