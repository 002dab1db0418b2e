"""When a target counts as lost, and what a frame is worth."""

from __future__ import annotations

from simbench.trackers.parts.confidence import Confidence


def test_usual_similarity_is_trusted_and_learnt() -> None:
    confidence = Confidence(0.9, 0.8)
    confidence.update(0.88, 0.79)
    assert confidence.trust == 1.0
    assert confidence.may_learn
    assert confidence.lost == 0


def test_trust_falls_with_the_similarity() -> None:
    trusts = []
    for best in (0.9, 0.78, 0.72, 0.6):
        confidence = Confidence(0.9, 0.8)
        confidence.update(best, 0.8)
        trusts.append(confidence.trust)
    assert trusts[0] == 1.0 > trusts[1] > trusts[2] > trusts[3] == 0.0


def test_low_similarity_counts_the_frames_without_the_target() -> None:
    confidence = Confidence(0.9, 0.8)
    for frames in (1, 2, 3):
        confidence.update(0.3, 0.3)
        assert confidence.lost == frames
        assert confidence.trust == 0.0
        assert not confidence.may_learn
    assert confidence.level == 0.9  # an occlusion is no new level


def test_way_to_a_target_found_again_is_not_trusted() -> None:
    confidence = Confidence(0.9, 0.8)
    confidence.update(0.3, 0.3)
    confidence.update(0.9, 0.8)
    assert (confidence.lost, confidence.trust) == (0, 0.0)
    confidence.update(0.9, 0.8)
    assert confidence.trust == 1.0


def test_structure_alone_does_not_permit_learning() -> None:
    confidence = Confidence(0.9, 0.8)
    confidence.update(0.85, 0.4)  # of something else, that the template has become
    assert not confidence.may_learn


def test_level_follows_a_lasting_change_slowly() -> None:
    confidence = Confidence(0.9, 0.8)
    for _ in range(10):
        confidence.update(0.7, 0.6)
    assert 0.8 < confidence.level < 0.9
    for _ in range(400):
        confidence.update(0.7, 0.6)
    assert confidence.level < 0.71
