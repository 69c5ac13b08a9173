"""What came of a run: the record, its file, its dataset, its summary and its small picture."""
