"""Make one recorded sequence anew and compare: what the workers of ``verify`` do."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from simbench.datasets.channels import CHANNELS
from simbench.datasets.native import read_sequence
from simbench.errors import DatasetError, SimbenchError
from simbench.producing.one_sequence import Order, produce
from simbench.producing.store import Store, open_store
from simbench.provenance import PARTS
from simbench.running.workers import Report
from simbench.scenarios.schema import Scenario
from simbench.verifying.likeness import Difference, Finding, differences, picture_gap

__all__ = ["STEPS", "remake_entry", "remake_sequence"]

STEPS = 1000
"""What progress is told in, however many frames there are."""


def remake_sequence(folder: Path, scratch: Path, report: Report) -> Finding:
    """Make the sequence of a folder anew, compare, and clear up.

    Parameters
    ----------
    folder : Path
        See `simbench.datasets.native`.
    scratch : Path
        Free name for a folder.
    report : callable of (done, total)
        Called with thousandths.
    """
    # here, so that the command that waits loads neither simulator nor renderer
    from simbench.generation import generate

    def in_thousandths(done: int, total: int) -> None:
        report(STEPS * done // total, STEPS)

    cv2.setNumThreads(1)
    try:
        kept = read_sequence(folder)
        scenario, seed = _origin(kept.scenario, kept.seed)
        channels = [name for name in CHANNELS if name in kept.channels]
        made = generate(
            scenario, seed, scratch, channels=channels, progress=in_thousandths
        )
        different = tuple(differences(kept, made))
        elsewhere = _elsewhere(kept.made_with, made.made_with)
        return Finding(folder.name, different, elsewhere=elsewhere)
    except SimbenchError as error:
        return Finding(folder.name, fault=str(error))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def remake_entry(
    place: str,
    how: Mapping[str, Any],
    entry: Mapping[str, Any],
    scratch: Path,
    report: Report,
) -> Finding:
    """Make one sequence of a data set anew, in its layout, compare, and clear up.

    Parameters
    ----------
    place : str
        Path or URL of the data set.
    how : mapping
        What ``dataset.json`` says of the whole: format, split, channels.
    entry : mapping
        What ``entries/`` says of this one, see `simbench.producing.one_sequence`.
    scratch : Path
        Free name for a folder.
    report : callable of (done, total)
        Called with thousandths.
    """
    name = str(entry.get("name", "?"))
    try:
        scenario, seed = _origin(entry["scenario"], entry["seed"])
        order = Order(
            name=name,
            key=entry["key"],
            scenario=scenario,
            seed=seed,
            layout=how["format"],
            split=how["split"],
            channels=tuple(how["channels"]),
            place=place,
            left_at=scratch,
        )
        result, reason = produce(order, report)
        if result != "made":
            return Finding(name, fault=reason)
        made = json.loads((scratch / "entry.json").read_text(encoding="utf-8"))
        different = _entry_differences(open_store(place), entry, made, scratch)
        then, now = (one["summary"]["made_with"] for one in (entry, made))
        return Finding(name, tuple(different), elsewhere=_elsewhere(then, now))
    except SimbenchError as error:
        return Finding(name, fault=str(error))
    except (KeyError, TypeError) as error:
        return Finding(name, fault=f"damaged entry: {error!r}")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _origin(
    content: Mapping[str, Any] | None, seed: int | None
) -> tuple[Scenario, int]:
    if content is None or seed is None:
        raise DatasetError("no scenario and seed are recorded: it was not made here")
    try:
        return Scenario.model_validate(content), seed
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise DatasetError(
            f"its scenario is not one of this version: {key}: {first['msg']}"
        ) from None


def _elsewhere(
    then: Mapping[str, str], now: Mapping[str, str]
) -> dict[str, tuple[str, str]]:
    return {
        name: (version, now.get(name, ""))
        for name, version in then.items()
        if now.get(name, "") != version
    }


def _entry_differences(
    store: Store, entry: Mapping[str, Any], made: Mapping[str, Any], root: Path
) -> Iterator[Difference]:
    """Yield what differs by the digests, then what does in the files."""
    recorded = entry["digests"]
    otherwise = [p for p in PARTS if made["digests"].get(p) != recorded.get(p)]
    for part in otherwise:
        if part != "frames":
            yield Difference(part, None, "by their digests")
    pictures = [path for path in entry["files"] if _is_picture(root / path)]
    first, detail = picture_gap(_picture_pairs(store, pictures, root))
    if detail or "frames" in otherwise:
        is_otherwise = "frames" in otherwise
        detail = detail or "by their digests"
        yield Difference("frames", first, detail, not is_otherwise, is_otherwise)
    others = [path for path in entry["files"] if path not in set(pictures)]
    wrong = [path for path in others if not _is_same(store, path, root / path)]
    if wrong:
        more = f" and {len(wrong) - 1} more" if len(wrong) > 1 else ""
        # The digest of the scenario stands in files; a version whose scenarios have
        # other keys gives another one.
        said = (one["summary"]["digest"] for one in (entry, made))
        is_otherwise = bool(otherwise) or len(set(said)) > 1
        yield Difference("files", None, wrong[0] + more, not is_otherwise, is_otherwise)


def _picture_pairs(
    store: Store, paths: list[str], root: Path
) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    for path in paths:
        (kept,) = store.read([path])
        new = _decoded((root / path).read_bytes(), path)
        yield _decoded(kept, path), new


def _decoded(content: bytes, path: str) -> NDArray[np.uint8]:
    encoded = np.frombuffer(content, np.uint8)
    found = cv2.imdecode(encoded, cv2.IMREAD_COLOR_RGB) if encoded.size else None
    if found is None:
        raise DatasetError(f"{path}: not a readable picture")
    return np.asarray(found, np.uint8)


def _is_picture(path: Path) -> bool:
    """Whether a file is a PNG of 8 bits a channel in colour, whatever its name."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(26)
    return head[1:4] == b"PNG" and head[24:26] == bytes([8, 2])


def _is_same(store: Store, path: str, made: Path) -> bool:
    (kept,) = store.read([path])
    return made.is_file() and made.read_bytes() == kept
