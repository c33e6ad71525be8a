"""The compiled loops of serial chains against numpy's columns: the same bits."""

import numpy as np
import pytest

import machines
from machines.kinematics import chain_loop
from machines.kinematics.serial import Serial

pytestmark = pytest.mark.numeric
CHAINS = sorted(name for name in machines.names() if isinstance(machines.load(name).kinematics, Serial))


@pytest.mark.parametrize("name", CHAINS)
def test_poses_have_the_bits_of_the_columns(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kin = machines.load(name).kinematics.with_tool(123.4)
    q = np.random.default_rng(5).normal(size=(300, kin.joints)) * 3.0
    found = []
    for chosen in (False, True):
        monkeypatch.setattr(chain_loop, "wanted", lambda *_, chosen=chosen: chosen)
        found.append([*kin.pose(q), *kin.forward(q)])
    for plain, fast in zip(*found, strict=True):
        np.testing.assert_array_equal(plain, fast)
        assert fast.flags.writeable


@pytest.mark.parametrize("name", CHAINS)
def test_slides_at_a_tip_have_the_bits_of_the_columns(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kin = machines.load(name).kinematics.with_tool(123.4)
    rng = np.random.default_rng(6)
    q, tips, slides = rng.normal(size=(300, kin.joints)) * 3.0, rng.normal(size=(300, 3)) * 200.0, np.arange(3)
    for tip in (tips, tips[:1], np.asfortranarray(tips)):
        found = []
        for chosen in (False, True):
            monkeypatch.setattr(chain_loop, "wanted", lambda *_, chosen=chosen: chosen)
            found.append(kin.at_tip(tip, q, slides))
        np.testing.assert_array_equal(*found)
        assert found[1].flags.writeable
    np.testing.assert_allclose(kin.forward(found[1])[0], tips, rtol=0, atol=1e-9)
