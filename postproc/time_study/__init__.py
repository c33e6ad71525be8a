"""What an engineer asks of times: side by side, what if, tables, a figure."""
