"""Campaigns: many episodes drawn from one scenario, each run alone and judged from outside."""
