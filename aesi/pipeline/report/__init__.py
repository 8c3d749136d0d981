"""Reports: one offline HTML file each, from a view (arrays and rows) that the pipeline builds."""
