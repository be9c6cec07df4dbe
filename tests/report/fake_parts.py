"""A diagnosis and a sizing made up, in the layout of gap.json and sizing.json."""

GAP = {
    "verdict": "coulomb_friction", "also": [], "probability": {"none": 0.001, "coulomb_friction": 0.999},
    "indistinguishable": [["coulomb_friction", "structural_damping_nonlinearity"]],
    "where": [
        {"quantity": "damping", "rig": "6#", "test": None, "record": None, "amplitude": [0.001, 0.08], "time_s": None,
         "excess": 0.0007, "interval90": [0.0006, 0.0008], "significance": 9.3, "detail": "", "effect": None}
    ] * 20,
    "shrink": {
        "fraction": 0.94, "interval90": [0.87, 0.96], "measurable": True, "runner_up": None,
        "held_out": {"fraction": 0.87, "interval90": [0.71, 0.93]}, "stable_amplitude": [],
    },
    "effects": {"coulomb_friction": {"parameters": {
        "size": {"median": 0.01, "interval90": [0.009, 0.011], "unit": "-", "form": "friction"}}}},
    "advice": ["one more decay"], "invisible": [{"text": "a gain of all channels"}], "calibrated_on": "simulations",
}  # fmt: skip
SPREAD = {"median": 0.12, "low": 0.08, "high": 0.17}


def sizing(required: float | None = 0.004, modes: int = 1, flags: tuple[str, ...] = ()) -> dict:
    texts = dict.fromkeys(("0.50", "0.84", "0.95", "0.99"), "none" if required == 0.0 else "0.400 %")
    limit = {
        "rule": "jtg", "title": "a code", "source": "", "confirm": "clause to be confirmed", "limit": 0.1,
        "probability": 0.8, "required": dict.fromkeys(texts, required), "required_text": texts,
        "curve": {"added_damping": [0.0, 0.002, 0.004], "probability": [0.8, 0.3, 0.05],
                  "probability_05": [0.7, 0.2, 0.0], "probability_95": [0.9, 0.4, 0.1],
                  "scruton_number": [15.0, 25.0, 35.0]},
    }  # fmt: skip
    damper = {
        "asked": {"risk": 0.05}, "achievable": True, "reason": "mass decides", "probability": 0.05,
        "stroke": {"median": 0.3, "high": 0.5},
        "dampers": [{"mass": 2500.0, "mass_ratio": 0.001, "frequency": 0.3, "damping_ratio": 0.1, "spring": 9000.0,
                     "dashpot": None}],
        "detuned": [{"detuning": -0.02, "probability": 0.2}],
    }  # fmt: skip
    mode = {
        "frequency": {"mean": 0.3}, "damping_ratio": {"mean": 0.003}, "scruton_number": SPREAD | {"median": 15.0},
        "amplitude": SPREAD, "limits": [limit], "governing": "jtg", "damper": damper,
    }  # fmt: skip
    names = [f"V{k + 1}" for k in range(modes)]
    return {
        "bridge": {"title": "A bridge"}, "amplitude_unit": "m", "laws": {"n=-1": 1.0},
        "modes": [mode | {"name": name} for name in names],
        "all_modes": {"names": names, "without": {"each": [0.8] * modes, "any": 0.9}}, "flags": list(flags),
        "provenance": {"bridge_sha256": {"bridge.toml": "ab" * 32}},
    }  # fmt: skip
