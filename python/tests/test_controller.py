"""A controller stepped by hand."""

from __future__ import annotations

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import ConfigError, Controller, Scenario, Status

SCENARIOS = ["paper-robust-adaptive", "paper-saturated"]
HOVER = np.array([0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0], dtype=np.float32)
REFERENCE = np.zeros(24, dtype=np.float32)
REFERENCE[16] = 1.0  # b2d along y


def test_status_has_the_bits_of_the_core() -> None:
    assert [(bit.name, bit.value) for bit in Status] == gyrfalcon._core.status_bits()


@pytest.mark.parametrize("name", SCENARIOS)
def test_at_rest_on_the_reference_the_thrust_is_the_estimated_weight(name: str) -> None:
    scenario = Scenario.builtin(name)
    controller = Controller(scenario)
    mass = 1.0 / controller.estimates["inverse_mass"]
    output = controller.step(HOVER, REFERENCE)
    assert output.thrust == pytest.approx(9.81 * mass, rel=1e-6)
    assert output.torque.tolist() == [0.0, 0.0, 0.0]
    assert output.wrench.tolist() == [output.thrust, 0.0, 0.0, 0.0]
    assert controller.intermediates["thrust"] == output.thrust
    assert len(controller.intermediates) == 24
    assert controller.intermediates["acting_torque_body"].tolist() == [0.0, 0.0, 0.0]


def test_a_mapping_makes_the_same_controller_as_its_scenario() -> None:
    scenario = Scenario.builtin("paper-saturated")
    tilted = HOVER + 0.1
    first = Controller(scenario).step(tilted, REFERENCE)
    second = Controller(scenario.controller).step(tilted.tolist(), REFERENCE[:18])
    assert first.wrench.tobytes() == second.wrench.tobytes()


def test_limits_per_axis_are_vectors_and_one_number_stands_for_all() -> None:
    scenario = Scenario.builtin("paper-saturated")
    assert Controller(scenario).bounds[2].tolist() == [np.float32(0.05)] * 3
    assert scenario.controller["saturated"]["torque_max"] == pytest.approx(0.05)
    unlike = scenario.set({"controller.saturated.torque_max": [0.05, 0.04, 0.01]})
    assert unlike.controller["saturated"]["torque_max"] == pytest.approx([0.05, 0.04, 0.01])
    assert Controller(unlike).bounds[2] == pytest.approx([0.05, 0.04, 0.01])


def test_a_refused_configuration_names_parameter_value_and_bound() -> None:
    config = Scenario.builtin("paper-saturated").controller
    config["saturated"]["k4"] = -1.0
    with pytest.raises(ConfigError) as caught:
        Controller(config)
    assert (caught.value.parameter, caught.value.value) == ("k4", -1.0)
    assert caught.value.bound == "positive" and caught.value.source
    with pytest.raises(ValueError, match="unknown variant"):
        Controller({"lee": {}})
    with pytest.raises(TypeError, match="Scenario"):
        Controller(object())  # type: ignore[arg-type]


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("hostile", [np.nan, np.inf, -np.inf, 3e38])
@pytest.mark.parametrize("place", [0, 4, 6, 12])
def test_input_that_is_not_finite_gives_a_bounded_held_output(
    name: str, hostile: float, place: int
) -> None:
    controller = Controller(Scenario.builtin(name))
    before = controller.step(HOVER, REFERENCE)
    estimates = controller.checkpoint()
    state = HOVER.copy()
    state[place] = hostile
    output = controller.step(state, REFERENCE)
    assert output.wrench.tobytes() == before.wrench.tobytes()
    assert Status(output.status) & Status.OUTPUT_HELD
    assert Status(output.status) & Status.STATE_INVALID
    assert controller.checkpoint() == estimates
    reference = REFERENCE.copy()
    reference[place] = hostile
    output = controller.step(HOVER, reference)
    assert Status(output.status) & Status.REFERENCE_INVALID
    assert np.isfinite(output.wrench).all()


@pytest.mark.parametrize(
    ("state", "reference", "message"),
    [
        (HOVER[:12], REFERENCE, "state has 12 numbers; it must have 13"),
        (HOVER, REFERENCE[:20], "reference has 20 numbers; it must have 24, or 18"),
    ],
)
def test_a_wrong_length_is_named(
    state: np.ndarray, reference: np.ndarray, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Controller(Scenario.builtin("lemniscate")).step(state, reference)


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_checkpoint_resumes_and_a_reset_begins_anew(name: str) -> None:
    controller = Controller(Scenario.builtin(name))
    first = controller.step(HOVER + 0.01, REFERENCE)
    for _ in range(100):
        controller.step(HOVER + 0.01, REFERENCE)
    checkpoint = controller.checkpoint()
    assert checkpoint["elapsed"] == pytest.approx(0.101)
    twin, resumed = controller.copy(), Controller(Scenario.builtin(name))
    resumed.resume(checkpoint)
    assert resumed.checkpoint() == checkpoint
    exact = twin.step(HOVER, REFERENCE).wrench
    assert controller.step(HOVER, REFERENCE).wrench.tobytes() == exact.tobytes()
    assert np.allclose(resumed.step(HOVER, REFERENCE).wrench, exact, atol=1e-4)
    checkpoint["inverse_mass"] = 1e6
    with pytest.raises(ConfigError, match="inverse_mass"):
        resumed.resume(checkpoint)
    controller.reset()
    again = controller.step(HOVER + 0.01, REFERENCE)
    assert again.wrench.tobytes() == first.wrench.tobytes()


def test_intermediates_need_a_step() -> None:
    with pytest.raises(ValueError, match="no step"):
        _ = Controller(Scenario.builtin("lemniscate")).intermediates


def test_arrays_of_any_kind_and_layout_are_taken() -> None:
    controller = Controller(Scenario.builtin("paper-saturated"))
    wide = np.zeros((13, 2))
    wide[:, 0] = HOVER
    assert controller.step(wide[:, 0], list(REFERENCE)).status == 0
