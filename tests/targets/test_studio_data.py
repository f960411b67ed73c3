"""What the page of the studio is written with, without a browser."""

import numpy as np
import pytest
from firmware_tools import ROOT

import reluctance as rl
from reluctance.targets.studio.write import curves


def test_the_curves_behind_the_energy_loop_are_flux_linkages():
    """Unaligned, the flux linkage of this model is L_u i; aligned, it saturates below L_a i."""
    drive = rl.load(ROOT / "examples" / "paper_rated.toml")
    machine, found = drive.machine, curves(drive)
    i, psi = np.array(found["i"]), np.array(found["psi"])
    assert (found["deg"][0], found["deg"][-1], i[-1]) == (0, 180, machine.i_max_A)
    assert psi[0] == pytest.approx(machine.L_u_H * i, rel=1e-4)
    assert np.all(np.diff(psi, axis=0)[:, 1:] > 0)
    assert np.all(psi[-1, 1:] < machine.L_a_H * i[1:])
