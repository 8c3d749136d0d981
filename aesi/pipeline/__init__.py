"""Use cases as plain functions: what a user keeps, what an experiment does, cases for the tracer, and reports."""
