"""Campaigns: many cases of a scenario with faults, and what came of them (docs/guides/campaigns.md)."""
