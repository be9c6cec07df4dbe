"""Griffin plots with credible bands from seconds of wind-tunnel transient.

The names below are fetched when they are first used, so that `import scruton` costs nothing.  The type checker reads
them from `__init__.pyi`.
"""

from importlib import import_module

_HOMES = {
    "Bridge": "scruton.sizing.bridge",
    "Campaign": "scruton.campaign",
    "Check": "scruton.dynamics.first_look",
    "Comparison": "scruton.report.compare",
    "Criticism": "scruton.infer.criticism",
    "Fit": "scruton.infer.results",
    "Identified": "scruton.dynamics.identify",
    "InputError": "scruton.errors",
    "ModelCard": "scruton.infer",
    "Prediction": "scruton.griffin",
    "Sizing": "scruton.sizing.results",
    "Validation": "scruton.griffin.validate",
    "build_report": "scruton.report",
    "check": "scruton.dynamics.first_look",
    "compare": "scruton.report.compare",
    "criticise": "scruton.app.calls",
    "diagnose": "scruton.app.calls",
    "fit": "scruton.app.calls",
    "fit_campaign": "scruton.infer.fit",
    "griffin_band": "scruton.griffin",
    "identify": "scruton.app.calls",
    "load_bridge": "scruton.app.calls",
    "load_campaign": "scruton.app.calls",
    "load_card": "scruton.infer",
    "load_diagnosis": "scruton.gap.results",
    "load_fit": "scruton.infer.store",
    "load_sizing": "scruton.app.calls",
    "plot": "scruton",
    "predict": "scruton.app.calls",
    "read_tree": "scruton.infer.store",
    "report": "scruton.report.call",
    "size": "scruton.app.calls",
    "tests_used": "scruton.campaign",
    "validate": "scruton.app.calls",
    "write_campaign": "scruton.simulate",
    "write_fit": "scruton.infer.store",
}

__all__ = [*_HOMES, "__version__"]


def __getattr__(name: str) -> object:
    if name == "__version__":
        return import_module("importlib.metadata").version("scruton")
    if name not in _HOMES:
        raise AttributeError(f"module 'scruton' has no attribute '{name}'")
    home = _HOMES[name]
    module = import_module(f"{home}.{name}" if home == __name__ else home)
    # What is imported may put a room of this name here, which is what is meant: `report` can be called.
    value = globals().get(name) or getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
