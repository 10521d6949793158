import numpy as np
import pytest

from ftqp.core.pose import rotation_exp, transform


@pytest.fixture
def start():
    return transform(rotation_exp(np.array([2.9, 0.3, -0.4])), np.array([0.4171, -0.113, 0.5337]))
