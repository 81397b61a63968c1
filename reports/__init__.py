"""Recorded pictures become numbers, verdicts and pages."""
