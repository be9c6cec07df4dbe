"""Griffin plots with credible bands from seconds of wind-tunnel transient.

The names below are fetched when they are first used, so that `import scruton` costs nothing.  The type checker reads
them from `__init__.pyi`.
"""

from importlib import import_module

_HOMES = {
    "Campaign": "scruton.campaign",
    "Fit": "scruton.infer.results",
    "InputError": "scruton.errors",
    "ModelCard": "scruton.infer",
    "Prediction": "scruton.griffin",
    "Sizing": "scruton.sizing.results",
    "build_report": "scruton.report",
    "fit_campaign": "scruton.infer.fit",
    "griffin_band": "scruton.griffin",
    "load_campaign": "scruton.campaign",
    "load_card": "scruton.infer",
    "load_diagnosis": "scruton.gap.results",
    "load_fit": "scruton.infer.store",
    "load_sizing": "scruton.sizing.results",
    "predict": "scruton.griffin",
    "read_tree": "scruton.infer.store",
    "tests_used": "scruton.campaign",
    "write_campaign": "scruton.simulate",
    "write_fit": "scruton.infer.store",
}

__all__ = [*_HOMES, "__version__"]


def __getattr__(name: str) -> object:
    if name == "__version__":
        return import_module("importlib.metadata").version("scruton")
    if name not in _HOMES:
        raise AttributeError(f"module 'scruton' has no attribute '{name}'")
    value: object = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
