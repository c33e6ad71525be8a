"""To and from other forms, figures, surveys."""
