"""What a new law on the command line leaves of the keys of the one before."""

from reluctance.drive.overrides import put


def control_after(new, **before):
    data = {"control": before}
    put(data, "control.law", new, "--set control.law")
    return data["control"]


def test_keys_of_an_own_law_stay_for_another():
    kept = {"T_s_us": 20, "i_set_A": 12, "i_band_A": 0.4, "theta_on_deg": 10}
    for law in ("python:b.py:B", "cpp:b.hpp:B"):
        assert control_after(law, law="python:a.py:A", **kept) == {"law": law, **kept}


def test_keys_that_a_law_of_the_library_does_not_have_go():
    after = control_after("ditc", law="python:a.py:A", T_s_us=20, i_set_A=12)
    assert after == {"law": "ditc", "T_s_us": 20}


def test_angles_of_an_own_law_are_not_those_of_one_of_the_library():
    own = {"T_s_us": 20, "theta_on_deg": 60, "theta_ov_deg": 25, "theta_off_deg": 150}
    for law in ("torque_sharing", "deadbeat", "angles", "ditc"):
        for before in ("python:a.py:A", "cpp:a.hpp:A"):
            assert control_after(law, law=before, **own) == {"law": law, "T_s_us": 20}
    kept = {"T_s_us": 20, "theta_on_deg": 10, "theta_ov_deg": 20}
    assert control_after("deadbeat", law="torque_sharing", **kept) == {"law": "deadbeat", **kept}
