"""The columns of the truth tables: name, Parquet type, unit and meaning of each."""

from __future__ import annotations

from typing import Any, NamedTuple

import pyarrow as pa

__all__ = ["COLUMNS", "TARGET_COLUMNS", "VEHICLE_COLUMNS", "Column"]


class Column(NamedTuple):
    """One column of a truth table.

    Attributes
    ----------
    name : str
    type : pyarrow.DataType
    unit : str
        Empty where there is none.
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
    origin = "from the outer corner of the top-left pixel; null where absent"
    return (
        Column(f"{name}_left_px", _REAL, "px", f"left edge of {what}, {origin}"),
        Column(f"{name}_top_px", _REAL, "px", f"top edge of {what}, {origin}"),
        Column(f"{name}_width_px", _REAL, "px", f"width of {what}"),
        Column(f"{name}_height_px", _REAL, "px", f"height of {what}"),
    )


_BOXES = (
    *_box("box", "the amodal box (hidden parts included, not clipped to the image)"),
    *_box("visible", "the box around the visible pixels"),
)
_VISIBLE_FRACTION = (
    "visible samples over those it would cover alone inside the image, 0 to 1; 0 where "
    "absent, null where unknown"
)
_DISPLACEMENT = (
    "distance between the centres of this and the previous amodal box; null in frame 0 "
    "and next to absent frames"
)
_ROTATION = "R, road frame to camera frame (x right, y down, z forward), row by row"
_COUNTS = "lengths of alternating runs of pixels in row-major order, the first of zeros"
_KIND = "lane_change; occlusion (any of it is hidden); absence; cut (by the image)"
_VISIBILITY = (
    Column("visible_fraction", _REAL, "", _VISIBLE_FRACTION),
    Column("absent", _FLAG, "", "no part of it projects into the image"),
    Column("cut_by_image", _FLAG, "", "a part of it projects outside the image"),
)

_VEHICLES = (
    *_WHEN,
    Column("vehicle", _TEXT, "", "name, unique in the sequence"),
    Column("id", _WHOLE, "", "its value in the instance masks"),
    Column("class", _TEXT, "", "car, suv, van, truck, trailer, bus, motorcycle, ball"),
    Column("is_target", _FLAG, "", "whether it is the vehicle to be tracked"),
    *_BOXES,
    Column("visible_px", _REAL, "px", "visible area in pixels of the frame"),
    *_VISIBILITY,
    Column("depth_m", _REAL, "m", "distance of its middle along the optical axis"),
    Column("x_m", _REAL, "m", "centre of its footprint, along the traffic"),
    Column("y_m", _REAL, "m", "centre of its footprint, to the left"),
    Column("z_m", _REAL, "m", "centre of its footprint, up"),
    Column("heading_rad", _REAL, "rad", "heading, counter-clockwise from x"),
    Column("pitch_rad", _REAL, "rad", "nose up positive; null where unknown"),
    Column("speed_mps", _REAL, "m/s", "along its path; null where unknown"),
    Column("length_m", _REAL, "m", "length of the body"),
    Column("width_m", _REAL, "m", "width of the body"),
    Column("height_m", _REAL, "m", "height of the body"),
    Column("colour", _TEXT, "", "paint as #rrggbb, sRGB"),
)

_TARGET = (
    *_WHEN,
    *_BOXES,
    *_VISIBILITY,
    Column("displacement_px", _REAL, "px", _DISPLACEMENT),
    Column("occluder", _TEXT, "", "what hides most of it; empty where nothing does"),
)

_CAMERAS = (
    *_WHEN,
    Column("matrix_px", pa.list_(_REAL, 9), "px", "intrinsics K, row by row"),
    Column("rotation", pa.list_(_REAL, 9), "", _ROTATION),
    Column("translation_m", pa.list_(_REAL, 3), "m", "t: camera point is R X + t"),
    Column("width_px", _WHOLE, "px", "width of the frame"),
    Column("height_px", _WHOLE, "px", "height of the frame"),
)

_MASKS = (
    _WHEN[0],
    Column("id", _WHOLE, "", "id of the vehicle, see the table of vehicles"),
    Column("height_px", _WHOLE, "px", "height of the mask"),
    Column("width_px", _WHOLE, "px", "width of the mask"),
    Column("counts", pa.list_(_WHOLE), "", _COUNTS),
)

_EVENTS = (
    Column("kind", _TEXT, "", _KIND),
    Column("vehicle", _TEXT, "", "name of the vehicle; that of the target is target"),
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
    "masks": _MASKS,
    "events": _EVENTS,
}
"""The columns of each table, in their order."""

_BOX_COLUMNS = {
    "boxes": tuple(column.name for column in _BOXES[:4]),
    "visible_boxes": tuple(column.name for column in _BOXES[4:]),
}
TARGET_COLUMNS: dict[str, tuple[str, ...]] = {
    **_BOX_COLUMNS,
    "visible_fraction": ("visible_fraction",),
    "absent": ("absent",),
    "cut_by_image": ("cut_by_image",),
    "displacement_px": ("displacement_px",),
}
"""The columns that hold each array of a `simbench.core.sequence.Truth`."""
VEHICLE_COLUMNS: dict[str, tuple[str, ...]] = {
    **_BOX_COLUMNS,
    "visible_px": ("visible_px",),
    "depths": ("depth_m",),
    "positions": ("x_m", "y_m", "z_m"),
    "headings": ("heading_rad",),
    "pitches": ("pitch_rad",),
    "speeds": ("speed_mps",),
    "visible_fraction": ("visible_fraction",),
}
"""The columns that hold each array of a `simbench.core.sequence.VehicleTruth`."""
