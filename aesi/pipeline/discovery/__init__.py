"""The tracer as a use case: cases in; discovery.json, report and model folder out."""
