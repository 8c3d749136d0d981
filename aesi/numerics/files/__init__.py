"""Files that are written whole, and arrays that are read whole."""
