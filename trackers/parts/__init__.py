"""Components of trackers: likelihoods, histograms, motion models and resampling."""
