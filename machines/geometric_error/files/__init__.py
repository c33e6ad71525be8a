"""Error model files: reading, covariance, fingerprint."""
