"""Parts that several trackers share: likelihoods, histograms, motion and resampling."""
