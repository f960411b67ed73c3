"""The tank: water is neither made nor lost, and days that repeat."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reluctance.pumping.tank import Tank, store


@settings(max_examples=50)
@given(
    flows=st.lists(st.tuples(st.floats(0, 50), st.floats(0, 50)), min_size=1, max_size=40),
    volume=st.floats(0, 100),
)
def test_water_is_neither_made_nor_lost_in_the_tank(flows, volume):
    inflow, demand = np.array(flows).T
    found = store(inflow, demand, Tank(volume_m3=volume, start_m3=0.0))
    kept = inflow.sum() - demand.sum() + found.missing.sum() - found.overflow.sum()
    assert found.level[-1] == pytest.approx(kept, abs=1e-9)
    assert np.all((found.level >= 0) & (found.level <= volume))


@settings(max_examples=50)
@given(
    flows=st.lists(st.tuples(st.floats(0, 50), st.floats(0, 50)), min_size=1, max_size=40),
    volume=st.floats(0, 100),
)
def test_without_a_stated_start_the_tank_ends_as_full_as_it_started(flows, volume):
    inflow, demand = np.array(flows).T
    found = store(inflow, demand, Tank(volume_m3=volume))
    assert found.level[-1] == pytest.approx(found.start, abs=1e-9)
    repeated = store(
        np.tile(inflow, 60), np.tile(demand, 60), Tank(volume_m3=volume, start_m3=volume)
    )
    # Brute force: days on days, from a full tank; a net loss may take longer than these to drain.
    if abs(inflow.sum() - demand.sum()) > volume / 50:
        last = repeated.missing[-len(inflow) :].sum()
        assert found.missing.sum() == pytest.approx(last, abs=1e-6)


@pytest.mark.parametrize("demand", [1e-3, 0.4, 1.0, 1e4])
def test_the_part_of_a_demand_that_is_missed_does_not_depend_on_its_size(demand):
    empty = Tank(volume_m3=0.0, start_m3=0.0)
    found = store(demand * np.array([0.5, 0.0]), demand * np.array([0.5, 1.5]), empty)
    assert found.loss_of_load == pytest.approx(0.75)
    assert store(np.ones(2), np.zeros(2), empty).loss_of_load == 0
