"""The picture of an arm shows every joint once, in each view and in its range."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import arm_picture

POINTS = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3], [0.3, 0.1, 0.6], [0.6, -0.1, 0.5]])
AXES = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
RANGES = np.array([[-1.0, 2.0], [-np.inf, np.inf], [0.0, 1.0]])
Z = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """The panels of a drawn picture."""
    kept = []
    monkeypatch.setattr(arm_picture, "save", lambda figure, path: kept.append(figure) or path)

    def draw(points=POINTS, up=Z):
        q = np.array([0.5, 9.0, 0.2])
        arm_picture.draw_arm(
            tmp_path / "a.png", "arm", ["a", "b", "c"], points, AXES, up, RANGES, q, [[0, 1, 2, 3, 4]]
        )
        return kept[-1].axes

    return draw


def texts(panel):
    return [text.get_text() for text in panel.texts]


def test_joints_that_coincide_share_a_label_and_base_and_tip_are_named(drawn):
    side, above, _ = drawn()
    assert texts(side) == ["1, 2", "3", "base", "tip"]
    assert texts(above) == ["1, 2", "3", "base", "tip"]
    assert (side.get_title(), above.get_title()) == ("from the side", "from above")


def test_arm_that_is_flat_has_one_view(drawn):
    flat = POINTS * [1.0, 1.0, 0.0]
    assert drawn(flat)[0].get_title() == "from above"
    assert len(drawn(flat)) == 2


def test_every_joint_has_its_range_and_an_endless_one_half_a_turn_either_way(drawn):
    panel = drawn()[-1]
    assert [label.get_text() for label in panel.get_yticklabels()] == ["1  a", "2  b", "3  c"]
    bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in panel.patches]
    assert bars[0] == (-1.0, 2.0)
    assert bars[1] == pytest.approx((9.0 - np.pi, 9.0 + np.pi))
    assert len(panel.lines) == 4 + 1  # two ends of each limited range, and the posture
