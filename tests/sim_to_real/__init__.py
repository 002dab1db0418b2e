"""Networks trained on films alone, on real clips: how far training seeds differ."""
