"""Candidates of the search: what one is made of, what all share, how one is fitted and judged."""
