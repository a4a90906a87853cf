"""Guards the parts over arrays: the same numbers as a step at a time, closed forms where there are some, states that come back."""

import copy
import os
import pickle

import numpy as np
import pytest

import anhyst

TERFENOL = anhyst.Material.terfenol_d()
WAY = 12e3 * np.sin(np.linspace(0.0, 20.0, 1000)) * np.linspace(1.0, 0.2, 1000)


def laws():
    radii = np.linspace(0.0, 2e3, 7)
    return {
        "plays": anhyst.Law.prandtl_ishlinskii(radii, 1.0 / (1.0 + np.arange(7)), line=0.5),
        "preisach": anhyst.Law.preisach(np.linspace(-1e4, 1e4, 6), np.arange(1.0, 16.0)),
        "lorentz": anhyst.Law.preisach_lorentz(1.0, 1e3, 2e3, 15e3, rows=12),
        "bouc-wen": anhyst.Law.bouc_wen(1e-5, 3e3, exponent=1.5, loading_share=0.8),
        "domain-wall": anhyst.Law.domain_wall(TERFENOL, gain=2.0),
        "creep": anhyst.Law.from_json(
            '{"offset": 1.0, "slope": 0.1, "laws": [], "creep": [{"time_constant_s": 0.1, "weight": 0.3}]}'
        ),
    }


@pytest.mark.parametrize("name", laws())
def test_a_law_in_arrays_is_the_law_in_steps(name):
    stepped, rowed, halved = laws()[name], laws()[name], laws()[name]
    steps = np.array([stepped.step(x, 1e-3) for x in WAY])
    np.testing.assert_array_equal(rowed.run(WAY, 1e-3), steps)
    # A view that is not contiguous, and a list, are the same numbers.
    doubled = np.repeat(WAY, 2)[::2]
    np.testing.assert_array_equal(laws()[name].run(doubled, 1e-3), steps)
    np.testing.assert_array_equal(laws()[name].run(list(WAY), 1e-3), steps)
    outputs, slopes = laws()[name].run_with_slopes(WAY, 1e-3)
    np.testing.assert_array_equal(outputs, steps)
    assert np.all(slopes >= 0.0) and np.ptp(steps) > 0.0

    halved.run(WAY[:500], 1e-3)
    kept, vector = halved.state, halved.state_vector
    beside = [copy.deepcopy(halved), pickle.loads(pickle.dumps(halved))]
    np.testing.assert_array_equal(halved.run(WAY[500:], 1e-3), steps[500:])
    for other in beside:
        np.testing.assert_array_equal(other.run(WAY[500:], 1e-3), steps[500:])
    halved.state = kept
    assert halved.state == kept
    np.testing.assert_array_equal(halved.run(WAY[500:], 1e-3), steps[500:])
    halved.state_vector = vector
    np.testing.assert_array_equal(halved.state_vector, vector)
    np.testing.assert_array_equal(halved.run(WAY[500:], 1e-3), steps[500:])
    halved.reset()
    assert halved.input == 0.0 and halved != stepped


def test_a_thousand_steps_have_the_bits_of_rust():
    told = os.environ.get("ANHYST_THOUSAND_STEPS")
    if told is None:
        pytest.skip("told by `cargo test -p anhyst-python`: what the laws give there")
    inputs, *columns = np.loadtxt(told, delimiter=",").T
    assert inputs.shape == (1000,) and len(columns) == 4
    own = [
        anhyst.Law.prandtl_ishlinskii([0.0, 500.0, 2e3], [1.0, 0.5, 0.25]),
        anhyst.Law.preisach_lorentz(1.0, 1e3, 2e3, 15e3, rows=40),
        anhyst.Law.bouc_wen(1e-5, 3e3, exponent=1.5, loading_share=0.8),
        anhyst.Law.domain_wall(TERFENOL, gain=2.0),
    ]
    for law, column in zip(own, columns):
        np.testing.assert_array_equal(law.run(inputs), column, err_msg=repr(law))


@pytest.mark.parametrize("name", laws())
def test_the_inverse_leads_where_it_should(name):
    law = laws()[name]
    wanted = law.copy().run(0.5 * WAY)
    inputs, reached = law.copy().invert(wanted, 2e4)
    assert reached.all()
    np.testing.assert_allclose(law.copy().run(inputs), wanted, rtol=0.0, atol=1e-9 * np.ptp(wanted))
    ahead, there = law.ahead(3e3)[0], law.input_for(law.ahead(3e3)[0], 2e4)
    assert there[1] and law.ahead(there[0])[0] == pytest.approx(ahead)
    assert not law.input_for(1e30, 2e4)[1]


def test_numbers_that_no_law_has_are_refused():
    with pytest.raises(anhyst.BadInput, match="yield input"):
        anhyst.Law.bouc_wen(1.0, -1.0)
    with pytest.raises(anhyst.BadInput, match="weights"):
        anhyst.Law.preisach([0.0, 1.0], [1.0, 1.0, 1.0])
    with pytest.raises(anhyst.BadInput, match="other numbers"):
        anhyst.Law.bouc_wen(1.0, 1.0).state = anhyst.Law.bouc_wen(1.0, 2.0).state
    with pytest.raises(anhyst.BadInput, match="not the state"):
        anhyst.Law.bouc_wen(1.0, 1.0).state_vector = [0.0]


def test_parameters_have_names_and_limits():
    (offset, amplitude, *_) = anhyst.Law.bouc_wen(3.0, 1.0).parameters()
    assert (offset["name"], offset["value"]) == ("offset", 0.0)
    assert (amplitude["value"], amplitude["lower"], amplitude["upper"]) == (3.0, 0.0, np.inf)
    law = anhyst.Law.prandtl_ishlinskii([0.0, 1.0], [2.0, 3.0], line=4.0)
    np.testing.assert_array_equal(law.weights, [0.0, 4.0, 2.0, 3.0])
    law.step(5.0)
    assert law.regressors() @ law.weights == law.output


def test_curves_are_coth_and_tanh():
    x = np.linspace(0.5, 9.0, 50)
    np.testing.assert_allclose(anhyst.Anhysteretic("langevin").value(x), 1 / np.tanh(x) - 1 / x, rtol=1e-13)
    ising = anhyst.Anhysteretic("ising")
    np.testing.assert_allclose(ising.value(x), np.tanh(x), rtol=1e-13)
    np.testing.assert_allclose(ising.inverse(ising.value(x[:20])), x[:20], rtol=1e-9)
    np.testing.assert_allclose(ising.slope(x), np.cosh(x) ** -2.0, atol=1e-14)
    with pytest.raises(anhyst.BadInput, match="langevin, ising"):
        anhyst.Anhysteretic("brillouin")


def test_a_bank_is_its_members():
    shapes = np.array([6500.0, 7012.0, 7500.0])
    bank = anhyst.Bank(TERFENOL, shapes)
    all_of_them = bank.run(WAY)
    assert all_of_them.shape == (1000, 3) and len(bank) == 3
    np.testing.assert_array_equal(all_of_them[-1], bank.magnetizations_a_per_m)
    for column, shape in zip(all_of_them.T, shapes):
        alone = TERFENOL.with_shape(shape).law.run(WAY)
        np.testing.assert_allclose(column, alone, rtol=0.0, atol=1e-6 * 7.65e5)


def test_a_rod_rings_as_it_should():
    rod = anhyst.Rod(1.3724e-2, 7889.9, 6.4251e7, 1e-5, force_gain_per_kg=2.0)
    assert rod.natural_frequency_hz == pytest.approx(np.sqrt(6.4251e7) / (2 * np.pi))
    at_rest = rod.run(np.full(2000, 1e5))
    assert at_rest[-1] == pytest.approx(1e5 * rod.dc_gain, rel=1e-9)
    rod.reset()
    np.testing.assert_array_equal([rod.step(1e5) for _ in range(2000)], at_rest)
    with pytest.raises(anhyst.BadInput, match="must be as many"):
        rod.run(np.zeros(3), np.zeros(4))


def test_strain_and_back():
    magnetizations = np.linspace(0.0, 3e5, 20)
    np.testing.assert_allclose(TERFENOL.magnetization_for(TERFENOL.strain(magnetizations)), magnetizations, rtol=1e-12)
    assert anhyst.Material.from_json(TERFENOL.to_json()) == TERFENOL


def test_an_actuator_in_arrays_is_one_in_steps():
    actuator = anhyst.Actuator.terfenol_d(1e-4)
    run = actuator.run(WAY)
    assert {name: own.shape for name, own in run.items()} == {
        name: (1000,) for name in ("field_a_per_m", "magnetization_a_per_m", "strain", "displacement_m", "temperature_k")
    }
    actuator.reset()
    np.testing.assert_array_equal([actuator.step(x) for x in WAY], run["displacement_m"])


def test_a_law_that_made_the_data_is_found():
    time_s = np.arange(4000) * 1e-3
    voltage = 50.0 * np.sin(2 * np.pi * time_s) * (1.0 + 0.5 * np.sin(2 * np.pi * 0.17 * time_s))
    law = anhyst.Law.prandtl_ishlinskii([0.0, 5.0, 15.0], [1e-7, 5e-8, 5e-8])
    displacement = law.run(voltage)
    fitted = anhyst.fit_law(voltage, displacement, 1e-3, law="prandtl-ishlinskii")
    assert fitted.nrmse < 0.01 and fitted.report["records"] == 1
    np.testing.assert_array_equal(fitted.predict(voltage, 1e-3), fitted.modelled[0])
    fitted.save("law.ron")
    assert anhyst.Law.load("law.ron").weights == pytest.approx(fitted.law.weights)
    # The command on the same numbers in a table finds the same.
    table = {"time_s": time_s, "voltage_V": voltage, "displacement_m": displacement}
    told = anhyst.fit(table, law="prandtl-ishlinskii", out="fitted")
    assert told.nrmse == fitted.nrmse
    assert told.file("law.ron").read_text() == fitted.ron
    # And a free run along them is the same to the bit.
    predicted = anhyst.predict("fitted/law.ron", table, out="predicted")
    modelled = np.genfromtxt(predicted.file("predict.csv"), delimiter=",", names=True)["modelled_displacement_m"]
    np.testing.assert_array_equal(modelled, fitted.modelled[0])


def test_the_regressor_follows_scikit_learn():
    base = pytest.importorskip("sklearn.base")
    from sklearn.model_selection import KFold, cross_val_score

    voltage = 50.0 * np.sin(np.linspace(0.0, 30.0, 3000)) * np.linspace(0.3, 1.0, 3000)
    displacement = anhyst.Law.prandtl_ishlinskii([0.0, 5.0, 15.0], [1e-7, 5e-8, 5e-8]).run(voltage)
    regressor = base.clone(anhyst.HysteresisRegressor(law="prandtl-ishlinskii", threads=1))
    assert regressor.get_params()["law"] == "prandtl-ishlinskii"
    assert base.is_regressor(regressor)
    fitted = regressor.fit(voltage[:, None], displacement)
    assert fitted is regressor and fitted.score(voltage[:, None], displacement) > 0.999
    np.testing.assert_array_equal(fitted.predict(voltage), pickle.loads(pickle.dumps(fitted)).predict(voltage))
    scores = cross_val_score(anhyst.HysteresisRegressor(law="linear"), voltage[:, None], displacement, cv=KFold(3))
    assert scores.shape == (3,)
    with pytest.raises(ValueError, match="shape"):
        regressor.predict(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="not fitted"):
        anhyst.HysteresisRegressor().predict(voltage)


def test_systems_of_python_control():
    control = pytest.importorskip("control")
    from anhyst.control import initial_state, law_system, rod_system

    law = anhyst.Law.bouc_wen(1e-5, 20.0)
    law.step(7.0)
    voltage = 40.0 * np.sin(np.linspace(0.0, 12.0, 300))
    answer = control.input_output_response(
        law_system(law, 1e-3), np.arange(300) * 1e-3, voltage, X0=initial_state(law)
    )
    np.testing.assert_array_equal(answer.outputs, law.copy().run(voltage, 1e-3))
    rod = rod_system(anhyst.Rod(1.3724e-2, 7889.9, 6.4251e7, 1e-5))
    assert control.dcgain(rod)[0, 0] == pytest.approx(1.3724e-2 / 6.4251e7)


def test_numbers_of_a_law_are_in_its_units(scenarios):
    stage = anhyst.Scenario(scenarios / "piezo/sine.ron")
    told = [("coil_field_a_per_m", "A/m"), ("magnetization_a_per_m", "A/m"), ("slope_m_per_a_per_m", "m/(A/m)"), ("temperature_k", "K")]
    assert [stage.unit_of(*own) for own in told] == ["V", "m", "m/(V)", "K"]
    assert anhyst.Scenario("built-in/milling.ron").unit_of("slope_m_per_a_per_m", "m/(A/m)") == "m/(A/m)"


def test_tables_share_what_was_read():
    pa, pd = pytest.importorskip("pyarrow"), pytest.importorskip("pandas")
    run = anhyst.run("built-in/milling.ron", set={"duration_s": 0.2, "expect.settling_s": 0.1})
    table = run.tokens.table("measurement")
    own = run.tokens["measurement"]["displacement_m"]
    column = table.column("displacement_m").chunk(0)
    assert column.buffers()[1].address == own.__array_interface__["data"][0]
    assert table.schema.field("displacement_m").metadata[b"unit"] == b"m"
    assert isinstance(table, pa.Table) and table.num_rows == 4000
    frame = run.tokens.frame("truth")
    assert isinstance(frame, pd.DataFrame) and frame.index.name == "time_s" and len(frame) == 4000


def test_a_run_has_a_picture():
    pytest.importorskip("matplotlib").use("agg")
    run = anhyst.run("built-in/milling.ron", set={"duration_s": 0.2, "expect.settling_s": 0.1})
    above, below = run.plot().axes
    (reference, moved), (error,) = above.lines, below.lines
    assert len(reference.get_xdata()) == len(moved.get_xdata()) == pytest.approx(2000, abs=1)
    left = run.tokens["demand"]["reference_m"] - run.tokens["truth"]["displacement_m"]
    np.testing.assert_array_equal(error.get_ydata(), 1e9 * left)
    assert len(run.plot(from_s=0.05, to_s=0.06).axes[0].lines[0].get_xdata()) == 200
