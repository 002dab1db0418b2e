"""The columns of the truth tables: name, Parquet type, unit and meaning of each."""

from __future__ import annotations

from typing import Any, NamedTuple

import pyarrow as pa

__all__ = ["COLUMNS", "Column"]


class Column(NamedTuple):
    """One column of a truth table.

    Attributes
    ----------
    name : str
    type : pyarrow.DataType
    unit : str
        Empty for what has none.
    meaning : str
    """

    name: str
    type: Any
    unit: str
    meaning: str


_REAL, _WHOLE, _TEXT, _FLAG = pa.float64(), pa.int64(), pa.string(), pa.bool_()

_WHEN = (
    Column("frame", _WHOLE, "", "0-based number of the frame"),
    Column("time_s", _REAL, "s", "time since the first frame"),
)


def _box(name: str, what: str) -> tuple[Column, ...]:
    origin = "from the outer corner of the top-left pixel; null where there is none"
    return (
        Column(f"{name}_left_px", _REAL, "px", f"left edge of {what}, {origin}"),
        Column(f"{name}_top_px", _REAL, "px", f"top edge of {what}, {origin}"),
        Column(f"{name}_width_px", _REAL, "px", f"width of {what}"),
        Column(f"{name}_height_px", _REAL, "px", f"height of {what}"),
    )


_BOXES = (
    *_box("box", "the amodal box (all of it, hidden or not, not cut to the image)"),
    *_box("visible", "the box around the visible pixels"),
)
_FRACTION = Column(
    "visible_fraction",
    _REAL,
    "",
    "visible samples over those it would cover alone inside the image, 0 to 1; 0 where "
    "absent, null where unknown",
)
_FLAGS = (
    Column("absent", _FLAG, "", "no part of it projects into the image"),
    Column("cut_by_image", _FLAG, "", "a part of it projects outside the image"),
)

_VEHICLES = (
    *_WHEN,
    Column("vehicle", _TEXT, "", "name, unique in the sequence"),
    Column("id", _WHOLE, "", "its value in the instance masks"),
    Column("class", _TEXT, "", "car, suv, van, truck, trailer, bus, motorcycle, ball"),
    Column("is_target", _FLAG, "", "whether it is the one to be tracked"),
    *_BOXES,
    Column("visible_px", _REAL, "px", "visible area in pixels of the frame"),
    _FRACTION,
    *_FLAGS,
    Column("depth_m", _REAL, "m", "distance of its middle along the optical axis"),
    Column("x_m", _REAL, "m", "centre of its footprint, along the traffic"),
    Column("y_m", _REAL, "m", "centre of its footprint, to the left"),
    Column("z_m", _REAL, "m", "centre of its footprint, up"),
    Column("heading_rad", _REAL, "rad", "heading, counter-clockwise from x"),
    Column("pitch_rad", _REAL, "rad", "nose up positive; null where unknown"),
    Column("speed_mps", _REAL, "m/s", "along its way; null where unknown"),
    Column("length_m", _REAL, "m", "length of the body"),
    Column("width_m", _REAL, "m", "width of the body"),
    Column("height_m", _REAL, "m", "height of the body"),
    Column("colour", _TEXT, "", "paint as #rrggbb, sRGB"),
)

_TARGET = (
    *_WHEN,
    *_BOXES,
    _FRACTION,
    *_FLAGS,
    Column(
        "displacement_px",
        _REAL,
        "px",
        "distance between the centres of this and the previous amodal box; null in "
        "frame 0 and next to absent frames",
    ),
    Column("occluder", _TEXT, "", "what hides most of it; empty where nothing does"),
)

_CAMERAS = (
    *_WHEN,
    Column("matrix_px", pa.list_(_REAL, 9), "px", "intrinsics K, row by row"),
    Column(
        "rotation",
        pa.list_(_REAL, 9),
        "",
        "R, road frame to camera frame (x right, y down, z forward), row by row",
    ),
    Column("translation_m", pa.list_(_REAL, 3), "m", "t: camera point is R X + t"),
    Column("width_px", _WHOLE, "px", "width of the frame"),
    Column("height_px", _WHOLE, "px", "height of the frame"),
)

_EVENTS = (
    Column(
        "kind",
        _TEXT,
        "",
        "lane_change; occlusion (any of it is hidden); absence; cut (by the image)",
    ),
    Column("vehicle", _TEXT, "", "whose event it is; the target is called target"),
    Column("first_frame", _WHOLE, "", "first frame of it; null where between frames"),
    Column("last_frame", _WHOLE, "", "last frame of it; null where between frames"),
    Column("start_s", _REAL, "s", "when it begins: for lane changes to the step"),
    Column("end_s", _REAL, "s", "when it ends"),
    Column("from_lane", _WHOLE, "", "lane left, 0 the right-most; lane changes only"),
    Column("to_lane", _WHOLE, "", "lane reached; lane changes only"),
    Column("hidden_peak", _REAL, "", "greatest hidden share, 0 to 1; occlusions only"),
    Column("occluder", _TEXT, "", "what hides it at the peak; the target's only"),
)

COLUMNS: dict[str, tuple[Column, ...]] = {
    "vehicles": _VEHICLES,
    "target": _TARGET,
    "cameras": _CAMERAS,
    "events": _EVENTS,
}
"""The columns of each table, in their order."""
