"""What cannot be used is refused in a sentence, with its place, before anything remembers it."""

import anhyst
import numpy as np
import pytest

X = np.sin(np.linspace(0.0, 30.0, 600))


def law():
    return anhyst.Law.prandtl_ishlinskii([0.1, 0.4], [1.0, 0.5])


@pytest.mark.parametrize(
    "call, told",
    [
        (lambda own: own.step(np.nan), "x, NaN, must be finite"),
        (lambda own: own.run([0.0, 1.0, np.inf]), "x[2] is inf"),
        (lambda own: own.step(1.0, -1e-3), "dt, -0.001"),
        (lambda own: own.invert([0.1], -1.0), "limit, -1"),
        (lambda own: own.invert([0.1], np.inf), "limit, inf"),
        (lambda own: own.invert([np.nan], 1.0), "y, NaN"),
        (lambda own: own.input_for(0.1, np.nan), "limit, NaN"),
    ],
)
def test_a_law_remembers_nothing_that_it_refused(call, told):
    own = law()
    own.run([0.3, -0.2])
    before = own.state
    with pytest.raises(anhyst.BadInput) as refused:
        call(own)
    assert told in str(refused.value)
    assert own.state == before


@pytest.mark.parametrize(
    "call, told",
    [
        (lambda: anhyst.Bank(anhyst.Material.terfenol_d(), [7e3]).run([0.0, np.nan]), "field_a_per_m[1] is NaN"),
        (lambda: anhyst.Rod(0.0137, 7890.0, 6.4e7, 5e-5).step(np.nan), "magnetization_a_per_m, NaN"),
        (lambda: anhyst.Rod(0.0137, 7890.0, 6.4e7, 5e-5).run([0.0, 1.0], [0.0, np.inf]), "force_n[1] is inf"),
        (lambda: anhyst.Actuator.terfenol_d(5e-5).step(np.nan), "command, NaN"),
    ],
)
def test_nor_does_what_else_has_a_state(call, told):
    with pytest.raises(anhyst.BadInput) as refused:
        call()
    assert told in str(refused.value)


@pytest.mark.parametrize(
    "given, told",
    [
        (np.zeros((3, 2)), "float64 of shape (3, 2)"),
        (np.array([1.0 + 1.0j]), "complex128"),
        (np.array(["2026-01-01"], dtype="datetime64[s]"), "datetime64"),
        ([[1.0], [2.0]], "list"),
        ("abc", "str"),
    ],
)
def test_what_is_no_row_of_real_numbers(given, told):
    with pytest.raises(TypeError) as refused:
        law().run(given)
    assert told in str(refused.value) and "shape (n,)" in str(refused.value)


@pytest.mark.parametrize(
    "x, y, time_s, told",
    [
        (np.r_[X[:5], np.nan, X[6:]], X, None, "the input[5] is NaN"),
        (X, np.r_[X[:7], np.inf, X[8:]], None, "the output[7] is inf"),
        (X, X, -1e-3, "it must rise"),
        (X, X, np.nan, "the time[0] is NaN"),
        (X, X, np.linspace(1.0, 0.0, 600), "it must rise"),
        (X, X[1:], None, "must be as many"),
    ],
)
def test_a_record_that_is_none(x, y, time_s, told):
    with pytest.raises(anhyst.BadInput) as refused:
        anhyst.fit_law(x, y, time_s, law="linear")
    assert told in str(refused.value)


def test_a_frame_over_its_time_keeps_it(tmp_path):
    pd = pytest.importorskip("pandas")
    time = np.arange(600) * 1e-3
    column = pd.DataFrame({"time_s": time, "voltage_V": 50.0 + 50.0 * X, "displacement_um": X})
    fits = [
        anhyst.fit(own, law="linear", out=tmp_path / str(number)).report
        for number, own in enumerate([column, column.set_index("time_s")])
    ]
    assert fits[0]["values"] == fits[1]["values"] and fits[0]["reaction"] == fits[1]["reaction"]


def test_names_that_are_none_are_answered_with_those_that_are(tmp_path):
    run = anhyst.run(
        "built-in/milling.ron",
        set={"duration_s": 0.1, "expect.settling_s": 0.05},
        out=tmp_path / "run",
    )
    with pytest.raises(KeyError, match="measurement"):
        run.tokens["nope"]
    with pytest.raises(TypeError, match="not Law"):
        anhyst.predict(law(), {"voltage_V": X})
    with pytest.raises(TypeError, match="ndarray"):
        anhyst.fit(X)
    with pytest.raises(anhyst.BadInput, match="are left"):
        anhyst.Loop(run.scenario).run(10**7)
    assert anhyst.check(run.scenario, set="controller.feedback.kp=0.3").path == run.scenario.path


def test_what_helps_stands_behind_the_sentence(tmp_path):
    data = tmp_path / "bare.csv"
    data.write_text("time_s,u_V,x_um\n" + "".join(f"{0.001 * k},{v},{v}\n" for k, v in enumerate(X)))
    with pytest.raises(anhyst.BadInput, match="has no input column") as refused:
        anhyst.fit(data, law="linear")
    assert "help: as its columns seem to be, give --column voltage=u_V" in str(refused.value)
