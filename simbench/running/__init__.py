"""Running trackers over scenarios and seeds in worker processes."""
