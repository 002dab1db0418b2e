"""Compare a recorded sequence with the same one generated again.

The digests of its parts say what came out otherwise, and whether files were changed
later; its decoded files say what differs, by how much, and from which frame.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field

from simbench.generation.digests import PARTS
from simbench.verification.compare_files import (
    compare_files,
    compare_frames,
    image_difference,
    is_colour_png,
)
from simbench.verification.difference import Difference, listed

__all__ = ["SequenceFiles", "compare_sequences"]


@dataclass(frozen=True, slots=True)
class SequenceFiles:
    """The files of one sequence, and what is recorded about them.

    Attributes
    ----------
    paths : set of str
    read : callable of (path)
        Returns the content of a file.
    digests : mapping from str to str
        Digest of each of `simbench.generation.digests.PARTS` when it was generated. A
        part without a digest is compared by its files alone.
    made_with : mapping from str to str
        Versions and devices that generated it.
    current_digests : mapping from str to str
        Digest of each part as its files are now, or the recorded one where this cannot
        be computed; without the parts that another version may write otherwise.
    sha256 : mapping from str to str
        Digest of each file when it was written; empty where unknown.
    """

    paths: Set[str]
    read: Callable[[str], bytes]
    digests: Mapping[str, str]
    made_with: Mapping[str, str]
    current_digests: Mapping[str, str] = field(default_factory=dict)
    sha256: Mapping[str, str] = field(default_factory=dict)


def compare_sequences(
    recorded: SequenceFiles, regenerated: SequenceFiles
) -> list[Difference]:
    """Compare a recorded sequence with the same one generated again.

    Parameters
    ----------
    recorded : SequenceFiles
    regenerated : SequenceFiles
        With the digests of all parts.

    Returns
    -------
    list of Difference
        One a part, in the order of `simbench.generation.digests.PARTS`, others last;
        empty where all is the same.

    Raises
    ------
    DatasetError
        If a file cannot be read, or an image not decoded.
    """
    found, altered = _compare_contents(recorded, regenerated)
    for only, paths in (
        ("recorded", recorded.paths - regenerated.paths),
        ("regenerated", regenerated.paths - recorded.paths),
    ):
        if paths:
            detail = f"only {only}: {listed(sorted(paths))}"
            found.append(Difference("file names", None, detail))
    differences = []
    for part in dict.fromkeys([*PARTS, *(one.part for one in found)]):
        of_part = [one for one in found if one.part == part]
        digest, now = recorded.digests.get(part), regenerated.digests.get(part)
        is_otherwise = digest is not None and digest != now
        if not of_part and not is_otherwise:
            continue
        current = recorded.current_digests.get(part)
        is_altered = part in altered or (
            # files that differ from those with the recorded digest were changed
            current is not None and (not is_otherwise or current != digest)
        )
        frames = [one.first_frame for one in of_part if one.first_frame is not None]
        differences.append(
            Difference(
                part,
                min(frames, default=None),
                listed(one.detail for one in of_part) or "by their digests",
                is_altered,
                is_otherwise or not is_altered,
            )
        )
    return differences


def _compare_contents(
    recorded: SequenceFiles, regenerated: SequenceFiles
) -> tuple[list[Difference], set[str]]:
    """Return what differs in the files of both, and the parts with altered files."""
    found: list[Difference] = []
    altered: set[str] = set()  # parts
    images: list[tuple[int, float]] = []
    altered_images: list[Difference] = []
    for path in sorted(recorded.paths & regenerated.paths):
        old, new = recorded.read(path), regenerated.read(path)
        sha256 = hashlib.sha256(old).hexdigest()
        is_altered = recorded.sha256.get(path, sha256) != sha256
        altered_file = [Difference("files", None, path)] if is_altered else []
        if is_colour_png(new):
            images.append(image_difference(path, old, new))
            altered_images += altered_file
            continue
        in_file = compare_files(path, old, new) or altered_file
        altered.update(one.part for one in in_file if is_altered)
        found += in_file
    in_images = compare_frames(images) or altered_images
    altered.update(one.part for one in in_images if altered_images)
    return [*found, *in_images], altered
