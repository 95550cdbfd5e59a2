"""The twin of a bench: its clearances along a record, and alarms where they change."""
