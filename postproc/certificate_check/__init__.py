"""The check of a certificate of a workspace; shares no code with what searched for it."""
