"""Compare the library with rays: ``python -m tests.verification.library_oracle``.

Three frames of every scenario: the first, the one whose target is nearest
to half hidden, and the last. Prints a table and writes it to ``results/oracle.md``;
exit status 1 if a bound is broken.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from simbench import __version__
from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError
from simbench.render.world.scene import build_scene, vehicle_poses
from simbench.runtime.versions import core_count, host
from simbench.scenarios.files.library import list_scenarios
from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.stage import Stage
from simbench.verification.cast_frames import cast_stage, whole_stage
from simbench.verification.frame_agreement import FrameAgreement
from simbench.verification.oracle import OracleResult
from simbench.verification.ray_caster import RayCaster
from simbench.verification.spacing import evenly_spaced

_PAGE = Path(__file__).parents[2] / "results" / "oracle.md"
_CANDIDATES = 9  # frames among which the most telling one is chosen


def telling_frames(stage: Stage) -> list[int]:
    """Return the first frame, the one nearest to half hidden, and the last."""
    count = len(stage.cameras)
    tried = list(evenly_spaced(range(count), _CANDIDATES))
    few = stage.with_frames(tried)
    caster = RayCaster(build_scene(few), few.trajectories.target)
    samples = stage.scenario.imaging.samples
    shares = [
        caster.hidden_share(camera, vehicle_poses(few.trajectories, index)[0], samples)
        for index, camera in enumerate(few.cameras)
    ]
    inner = tried[1:-1]
    best = inner[int(np.argmin(np.abs(np.array(shares[1:-1]) - 0.5)))]
    return [0, best, count - 1]


def compare(name: str) -> OracleResult:
    """Render three frames of a scenario of the library, and cast rays for them."""
    try:
        stage = whole_stage(load_scenario(name), 0)
        frames = telling_frames(stage)
        found = cast_stage(stage.with_frames(frames))
    except SimbenchError as error:
        return OracleResult(name, fault=str(error))
    numbered = (
        replace(one, frame=frame) for one, frame in zip(found, frames, strict=True)
    )
    return OracleResult(name, tuple(numbered))


def main(jobs: int) -> int:
    """Compare all, ``jobs`` at a time, and write the page."""
    began = time.monotonic()
    context = multiprocessing.get_context("spawn")
    results = []
    with ProcessPoolExecutor(jobs, mp_context=context) as pool:
        for result in pool.map(compare, list_scenarios()):
            results.append(result)
            print(result, file=sys.stderr, flush=True)
    page = report(results, time.monotonic() - began)
    print(page)
    with atomic_write(_PAGE) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return 0 if all(result.agrees for result in results) else 1


def report(results: list[OracleResult], seconds: float) -> str:
    """Return the table of scenarios as Markdown."""
    frames = [frame for result in results for frame in result.frames]
    apart = [_apart(one) for one in frames]
    differences: Counter[tuple[str, str]] = Counter()
    for frame in frames:
        for hit, shown, count in frame.differences:
            differences[hit, shown] += count
    broken = [f"- {result}" for result in results if not result.agrees]
    lines = [
        "# Truth and rays",
        "",
        f"`make oracle`, simbench {__version__}, {host()['processor']}, "
        f"{core_count()} cores, {seconds / 60.0:.0f} minutes.",
        "",
        "Embree casts the ray of every sample at the meshes of the scene. Of each",
        "scenario, seed 0, three frames: the first, the one whose target is nearest to",
        "half hidden (of nine), the last. The worst of the three is shown.",
        "",
        "| scenario | ids equal, % | at edges, % | levels of detail, % | depth, mm "
        "| depth within, % | target, samples | hidden | apart |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_row(result) for result in results if result.frames),
        "",
        "Equal ids: of the samples away from edges (no neighbour's ray hits another",
        "object), at least 99.9 %; and of those at edges, without a bound. Levels of",
        "detail: samples that differ at vehicles so small in the picture that they are",
        "drawn with few triangles, at most .05 %; they do not count in equal ids.",
        "Depth: median of the difference on smooth surfaces, and samples within 1 mm",
        "and 0.1 % of the depth, at least 99.9 %. Hidden: the largest share of the",
        "target that the truth calls hidden; apart: the largest difference from the",
        f"share by rays, at most .005. Over all {len(frames)} frames the median of",
        f"that is {np.median(apart):.4f}, the largest {max(apart):.4f}.",
        "",
        "Samples away from edges that differ, by what the ray hits and what is drawn:",
        "",
        *(
            f"- {hit}, drawn as {shown}: {count}"
            for (hit, shown), count in differences.most_common()
        ),
        "",
        "Ground drawn as sky: cracks of the rasteriser, where a corner of one piece",
        "of the ground meets the side of another. The others: parts thinner than a",
        "sample, such as a guard rail far away, whose corners the rasteriser rounds",
        "to 1/256 of a sample.",
        "",
        *(
            ["Bounds broken:", "", *broken, ""]
            if broken
            else ["No bound is broken.", ""]
        ),
    ]
    return "\n".join(lines)


def _row(result: OracleResult) -> str:
    frames = result.frames
    hidden = max(frames, key=lambda one: one.hidden_by_camera)
    cells = [
        f"`{result.name}`",
        f"{100 * min(one.equal_ids for one in frames):.4f}",
        f"{100 * min(one.equal_beside_edges for one in frames):.2f}",
        f"{100 * max(one.of_detail for one in frames):.4f}",
        f"{1000 * max(one.depth_median_m for one in frames):.2f}",
        f"{100 * min(one.depth_within for one in frames):.4f}",
        f"{min(one.target_samples for one in frames)}",
        f"{hidden.hidden_by_camera:.4f}",
        f"{max(_apart(one) for one in frames):.4f}",
    ]
    return f"| {' | '.join(cells)} |"


def _apart(frame: FrameAgreement) -> float:
    return abs(frame.hidden_by_camera - frame.hidden_by_rays)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else core_count()))
