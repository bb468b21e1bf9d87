"""Fault-injection campaigns: runs many cases of a scenario and evaluates their outcomes (docs/guides/campaigns.md)."""
