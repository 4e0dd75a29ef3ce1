"""What comes of a dataset: numbers, pictures, files."""
