"""What work runs on: worker processes, clusters, locks, versions and code digests."""
