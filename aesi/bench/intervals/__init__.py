"""The intervals: one step ahead against MAPIE, and bands of the free run on virtual cells."""
