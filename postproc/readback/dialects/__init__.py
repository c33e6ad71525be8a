"""One class per dialect: text to canonical words."""
