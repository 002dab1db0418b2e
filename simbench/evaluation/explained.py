"""What each measure of the run table means, in one line; docs/measures.md has more."""

from __future__ import annotations

from typing import Final

from simbench.evaluation.measures.attributes import ATTRIBUTES

__all__ = ["EXPLAINED"]

EXPLAINED: Final = {
    "precision_20": "share of frames whose centre is at most 20 px off",
    "success_50": "share of frames with an overlap above 0.5",
    "success_auc": "mean of the success curve (area under it)",
    "average_overlap": "mean overlap (AO)",
    "success_75": "share of frames with an overlap above 0.75",
    "norm_precision": "share of frames whose centre is at most 0.2 true sizes off",
    "norm_precision_area": "mean of the same share at 0, 0.01, ..., 0.5",
    "center_error_px": "mean distance of the centres in frames with an estimate, px",
    "center_error_median_px": "median distance of the centres, infinite for a miss, px",
    "fps": "updates per second, without initialisation; a dash for no work",
    "particles_min": "fewest particles in a frame",
    "particles_mean": "particles per frame",
    "frames": "frames of the sequence",
    "frames_scored": "frames that count by the rules",
    "frames_absent": "frames without the target in the image",
    "frames_lost": "frames that count and have no estimate",
    "frames_said_absent": "frames in which the tracker says that the target is absent",
    "seconds_init": "time of the initialisation, s",
    "seconds_p95": "time that 95 % of the updates keep, s",
    "seconds_total": "time of initialisation and updates, s",
    "rules": "by whose rules the shares are computed",
    "protocol": "from which frames and boxes the tracker is started",
    "start_frame": "frame of the sequence in which this run begins",
    "variation": "what is special about its start: a shift or scale, backwards",
    "width_px": "width of the image, px",
    "height_px": "height of the image, px",
    "confidence_auc": "how well confidence tells frames on the target (overlap above "
    "0.5) from others; 0.5 is chance",
    "confidence_visible_auc": "how well it tells a visible from a hidden target",
    "calibration_error": "mean difference of confidence and the share of frames on the "
    "target",
    "alarm_delay_frames": "frames from a loss to a confidence below 0.5, mean",
    "losses_unnoticed": "losses without a confidence below 0.5 before the end of them",
    "false_alarms": "share of frames on a visible target with a confidence below 0.5",
    "losses": "losses of the target: five frames with an overlap of at most 0.1",
    "occlusions": "occlusions: runs of frames in which less than half is visible",
    "losses_per_occlusion": "share of occlusions, entered with the target, in which it "
    "is lost",
    "recoveries": "losses after which the target is found again (overlap above 0.5)",
    "recovery_frames": "frames from a loss to finding again, mean of those found",
    "recovery_s": "time from a loss to finding again, mean of those found, s",
    "held_s": "time to the first loss; to the end without one, s",
    "is_lost": "whether there is a loss; if not, the time to it is censored",
    "failure_kind": "why most wrong frames are wrong",
    "failure_frame": "first frame that is wrong for that reason",
    **{
        f"overlap_{name}": f"mean overlap while {text}"
        for name, text in ATTRIBUTES.items()
    },
    "vots_quality": "VOTS quality: mean overlap, agreement on absence counts as 1",
    "vots_accuracy": "VOTS accuracy: mean overlap of the frames with any",
    "vots_robustness": "VOTS robustness: share of frames with the target that touch it",
    "vots_nre": "VOTS not-reported error: share of frames with the target said absent",
    "vots_dre": "VOTS drift-rate error: share of frames with the target and a box "
    "elsewhere",
    "vots_adq": "VOTS absence-detection quality: share of frames without the target "
    "that are said absent",
    "longterm_precision": "tracking precision at the confidence of the best F",
    "longterm_recall": "tracking recall at the confidence of the best F",
    "longterm_f": "tracking F: harmonic mean of the two at the best confidence",
    "position_error_m": "distance on the road between estimated and true position, m",
    "speed_error_kmh": "difference of estimated and true speed, mean, km/h",
}
"""Columns of `simbench.evaluation.scores.Scores.runs` that are measured."""
