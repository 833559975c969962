"""Where bakes run and what they remember: store, workers, publishing, code digests."""
