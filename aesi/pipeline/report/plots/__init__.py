"""The figures of the reports, one module a subject; arrays in, a plotly figure out."""
