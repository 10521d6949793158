"""Only values that a control can have, the camera and the handle are taken of what a browser says."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftqp.viz.live.heard import LONGEST, is_taken

CONTROLS = {
    "row": SimpleNamespace(value="lock", props=SimpleNamespace(options=("lock", "free"))),
    "speed": SimpleNamespace(value=1.0, props=SimpleNamespace(min=0.1, max=5.0)),
    "delay": SimpleNamespace(value=0.5, props=SimpleNamespace(min=0.0, max=None)),
    "box": SimpleNamespace(value=False, props=SimpleNamespace()),
    "text": SimpleNamespace(value="", props=SimpleNamespace()),
    "other": SimpleNamespace(value=(1, 2), props=SimpleNamespace()),
}
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [1.0, 2, 3], "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1], "fov": 0.8, "near": 0.01, "far": 1000, "image_height": 480, "image_width": 640,
}  # fmt: skip
HANDLE = {
    "type": "TransformControlsUpdateMessage", "name": "/arm-1/handle", "owner": "", "wxyz": [0, 1, 0, 0],
    "position": [0.1, 0.2, 0.3],
}  # fmt: skip
NAN, INFINITE = float("nan"), float("inf")


def taken(message, size=100):
    return is_taken(message, size, CONTROLS.get)


def update(uuid, **updates):
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates}


@pytest.mark.parametrize(
    ("uuid", "values"),
    [
        ("row", ["lock", "free"]),
        ("speed", [0.1, 1, 5.0, 5.000000001]),
        ("delay", [0, 60.0]),
        ("box", [True, False]),
        ("text", ["", "j1 @ 2.00"]),
    ],
)
def test_values_that_a_control_can_have_are_taken(uuid, values):
    assert all(taken(update(uuid, value=value)) for value in values)


@pytest.mark.parametrize(
    ("uuid", "values"),
    [
        ("row", ["repair", "", 1, None, ["lock"], b"lock"]),
        ("speed", [0.0, -1.0, 5.1, 1e300, NAN, INFINITE, "1.0", True, None, [1.0], 10**18]),
        ("delay", [-0.1, NAN, 1e7]),
        ("box", [1, 0, "true", None]),
        ("text", ["x" * (LONGEST + 1), 5, None, {"a": 1}]),
        ("other", [(1, 2), [1, 2]]),
        ("nobody", [True, "lock", 1.0]),
    ],
)
def test_values_that_it_cannot_have_are_dropped(uuid, values):
    assert not any(taken(update(uuid, value=value)) for value in values)


@pytest.mark.parametrize(
    "name", ["props", "options", "update_cb", "disabled", "min", "removed", "visible", "content"]
)
def test_no_other_property_of_a_control_is_set(name):
    assert not taken(update("row", **{name: "lock"}))
    assert not taken(update("row", **{name: "lock", "value": "lock"}))


@pytest.mark.parametrize("message", [CAMERA, HANDLE])
def test_camera_and_handle_are_taken_where_all_numbers_are_usable(message):
    assert taken(message)
    for name in message.keys() - {"type"}:
        kept = {key: value for key, value in message.items() if key != name}
        assert taken(kept) is (name == "owner")
        for wrong in (None, NAN, [NAN, 0, 0], [1e9, 0, 0], [2, 0, 0, 0], {}, "x" * (LONGEST + 1), -1e9):
            assert not taken({**message, name: wrong}), (name, wrong)
    assert not taken({**message, "more": 1})


@pytest.mark.parametrize(
    "kind",
    ["FileTransferStartUpload", "FileTransferPart", "ShareUrlRequest", "GuiFormSubmitMessage", "", None, 5,
     "CommandTriggerMessage", "SceneNodeClickMessage", "ScenePointerMessage", "SceneNodeUpdateMessage"],
)  # fmt: skip
def test_messages_that_no_page_of_ours_sends_are_dropped(kind):
    assert not taken({"type": kind})


def test_long_messages_are_dropped_but_for_pictures():
    picture = {"type": "GetRenderResponseMessage", "payload": b"x", "render_uuid": "u"}
    assert taken(picture, 1 << 20) and not taken(picture, 1 << 26)
    assert not taken(update("text", value="x"), 1 << 20)


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["type", "uuid", "updates", "value", "wxyz", "name"]) | st.text(max_size=4),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(ANYTHING)
def test_nothing_that_can_be_said_raises(message):
    assert taken(message) in (True, False)
    assert is_taken(update("speed", value=message), 10, CONTROLS.get) in (True, False)
    assert is_taken({**HANDLE, "wxyz": message}, 10, CONTROLS.get) in (True, False)
