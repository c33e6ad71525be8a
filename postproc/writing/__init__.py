"""Text in each control's dialect."""
