"""Scenarios, and the exceptions of those that cannot be flown."""

from __future__ import annotations

import pickle
from pathlib import Path

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import Scenario, ScenarioError


def test_every_built_in_scenario_opens_and_its_text_reads_back() -> None:
    names = gyrfalcon.built_in_scenarios()
    assert {"paper-robust-adaptive", "paper-saturated"} <= set(names)
    for name in names:
        scenario = Scenario.builtin(name)
        assert scenario.name == name
        assert Scenario.parse(scenario.to_toml()) == scenario
        assert pickle.loads(pickle.dumps(scenario)) == scenario


def test_set_changes_a_copy_by_path() -> None:
    scenario = Scenario.builtin("paper-saturated")
    changes = {
        "vehicle.mass": np.float64(0.95),
        "vehicle.inertia": np.array([0.05, 0.06, 0.1]),
        "vehicle.inertia[0]": 0.055,
        "seed": 7,
        "description": "another = one",
        "controller.saturated.uncertainty.mass": {"lower": 0.5, "upper": 1.0},
    }
    changed = scenario.set(changes)
    assert (scenario.mass, scenario.seed) == (0.85, 1)
    assert (changed.mass, changed.seed, changed.description) == (0.95, 7, "another = one")
    assert changed.inertia.tolist() == [0.055, 0.06, 0.1]
    assert changed.controller["saturated"]["uncertainty"]["mass"]["lower"] == 0.5
    assert changed != scenario
    assert changed.set({"seed": 1}).seed == 1


def test_a_fault_in_a_file_names_file_line_key_and_bound(tmp_path: Path) -> None:
    text = Scenario.builtin("paper-saturated").to_toml()
    line = next(i for i, row in enumerate(text.splitlines(), 1) if row.startswith("mass = 0.85"))
    path = tmp_path / "mine.toml"
    path.write_text(text.replace("mass = 0.85", "mass = -0.85"))
    with pytest.raises(ScenarioError, match="must be positive") as caught:
        Scenario.load(path)
    error = caught.value
    assert (error.file, error.line, error.key) == (str(path), line, "vehicle.mass")
    assert (error.bound, error.change) == ("positive", None)
    assert str(error).startswith(f"{path}:{line}: vehicle.mass: ")


@pytest.mark.parametrize(
    ("path", "value", "bound"),
    [
        ("vehicle.mass", -1.0, "positive"),
        ("vehicle.mass", float("nan"), "positive"),
        ("initial.tilt_deg", 200.0, "in [0, 180] deg"),
        ("controller.saturated.torque_max", 0.0, "positive"),
        ("vehicle.mas", 1.0, None),
        ("duration", "long", None),
    ],
)
def test_a_refused_change_names_key_change_and_bound(
    path: str, value: object, bound: str | None
) -> None:
    with pytest.raises(ScenarioError) as caught:
        Scenario.builtin("paper-saturated").set({path: value})
    error = caught.value
    assert error.file is None and error.line is None
    assert error.change is not None and error.change.startswith(f"{path}=")
    if bound is not None:
        assert (error.key, error.bound) == (path, bound)
    assert isinstance(error, ValueError)


def test_an_inequality_of_several_values_names_their_table_and_its_bound() -> None:
    with pytest.raises(ScenarioError, match="m_hi") as caught:
        Scenario.builtin("paper-saturated").set({"controller.saturated.cascade.M1": 9.0})
    assert (caught.value.key, caught.value.bound) == ("controller.saturated", "at most 12")
    assert caught.value.file == "paper-saturated" and caught.value.line == 37


def test_a_misspelt_name_gets_the_nearest_one() -> None:
    with pytest.raises(ScenarioError, match="did you mean `paper-saturated`"):
        Scenario.builtin("paper-satruated")
    with pytest.raises(ScenarioError, match="did you mean `tilt-recovery`"):
        gyrfalcon.run("tilt-recovry")
    with pytest.raises(FileNotFoundError):
        Scenario.load("missing.toml")


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="missing.toml"):
        Scenario.load(tmp_path / "missing.toml")


def test_what_has_no_toml_is_refused() -> None:
    with pytest.raises(TypeError, match="no TOML"):
        Scenario.builtin("lemniscate").set({"seed": object()})


def test_references_are_those_of_the_trajectory() -> None:
    scenario = Scenario.builtin("paper-saturated")
    rows = scenario.reference([0, 1000])
    assert rows.shape == (2, 24) and rows.dtype == np.float32
    assert np.allclose(rows[1, :2], [100 * np.cos(0.05), 100 * np.sin(0.05)], atol=1e-4)
    assert np.allclose(rows[1, 15:18], [np.sin(0.05), -np.cos(0.05), 0.0], atol=1e-6)
