"""What a report says in sentences: of a run, of a discovery, of sizes, of what a refit moved."""
