"""Session documents: what is read, and that any JSON at all is either read or refused by its field."""

from __future__ import annotations

import copy
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pondwatch.core.errors import InvalidLayout
from pondwatch.core.inspection import inspection_document, parse_inspection
from pondwatch.core.values import Camera, Inspection, Pond, PoseNoise, Rod

DOCUMENT = {
    "format": "pond-session/1",
    "name": "north pond",
    "camera": {"width_px": 160, "height_px": 110, "metres_per_pixel": 0.0005},
    "pose_noise": {"sigma_xy_m": 0.01, "sigma_theta_rad": 0.1},
    "pond": {
        "width_m": 0.5,
        "height_m": 0.3,
        "rods": [{"id": "R0", "x_m": 0.1, "y_m": 0.2, "outer_radius_m": 0.012, "inner_radius_m": 0.008}],
    },
    "something": "new",
}
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


def changed(path, value):
    document = copy.deepcopy(DOCUMENT)
    holder = document
    for step in path[:-1]:
        holder = holder[step]
    holder[path[-1]] = value
    return document


def test_a_document_is_read_and_fields_not_known_are_passed_over():
    assert parse_inspection(DOCUMENT) == Inspection(
        "north pond",
        Camera(160, 110, 0.0005),
        Pond(0.5, 0.3, (Rod("R0", 0.1, 0.2, 0.012, 0.008),)),
        PoseNoise(0.01, 0.1),
    )


def test_a_document_written_and_read_again_is_the_same_inspection():
    inspection = parse_inspection(DOCUMENT)

    assert parse_inspection(json.loads(json.dumps(inspection_document(inspection)))) == inspection


@pytest.mark.parametrize("absent", ["pose_noise", "name"])
def test_noise_and_name_may_be_absent(absent):
    inspection = parse_inspection({k: v for k, v in DOCUMENT.items() if k != absent})

    assert (inspection.pose_noise is None, inspection.name == "unnamed") == (absent == "pose_noise", absent == "name")


def test_a_rod_given_twice_under_two_names_names_both():
    rods = [DOCUMENT["pond"]["rods"][0] | {"id": name, "x_m": x} for name, x in (("A", 0.1), ("B", 0.2), ("C", 0.102))]

    with pytest.raises(InvalidLayout, match=r"pond\.rods\[2\] 'C' lies on 'A', pond\.rods\[0\]"):
        parse_inspection(changed(["pond", "rods"], rods))


@pytest.mark.parametrize("value", [10**400, float("inf"), True, "0.5", None, -0.1, 0])
def test_a_size_that_is_no_length_is_refused(value):
    with pytest.raises(InvalidLayout) as caught:
        parse_inspection(changed(["pond", "width_m"], value))

    assert caught.value.facts["field"] == "pond.width_m"
    assert len(caught.value.message) < 200


@given(
    st.sampled_from(
        [
            ["format"], ["name"], ["camera"], ["camera", "height_px"], ["pose_noise"], ["pose_noise", "sigma_xy_m"],
            ["pond"], ["pond", "rods"], ["pond", "rods", 0], ["pond", "rods", 0, "id"], ["pond", "rods", 0, "y_m"],
        ]
    ),
    json_values,
)  # fmt: skip
def test_any_json_in_any_place_is_read_or_refused_by_a_field(path, value):
    field = path[0]
    try:
        parse_inspection(changed(path, value))
    except InvalidLayout as error:
        field = str(error.facts["field"])

    assert field.startswith(path[0])
