"""What is picked of all candidates: the mean of the fittest, and nested cross-validation of the pick."""
