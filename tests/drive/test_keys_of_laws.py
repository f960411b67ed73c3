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
