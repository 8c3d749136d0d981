"""Arrays on their way into a page: binned, thinned, and embedded once."""
