"""Many cells, one discovery each: the plan, one job, and the summary."""
