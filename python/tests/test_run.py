"""Guards that a run from Python is the command line's run: same bits, same files, same refusals, and nothing printed."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import anhyst

SHORT = {"duration_s": 0.2, "expect.settling_s": 0.1}


def command_line(executable, *words):
    return subprocess.run([executable, *map(str, words)], capture_output=True, text=True)


def test_a_run_has_the_bits_of_the_command_line(scenarios, executable):
    told = command_line(executable, "run", scenarios / "milling.ron", "--embedded", "--no-recording", "--json", "--out", "there")
    there = json.loads(told.stdout)
    here = anhyst.run(scenarios / "milling.ron", recording=False)
    assert here.digest == there["digest"]
    assert here.summary["node_digests"] == there["node_digests"]
    for figure in ("error_rms_m", "error_max_m", "held", "ticks"):
        assert here.summary[figure] == there[figure], figure


def test_processes_embedded_and_stepped_give_one_digest(scenarios):
    embedded = anhyst.run(scenarios / "milling.ron", set=SHORT, recording=False)
    processes = anhyst.run(scenarios / "milling.ron", set=SHORT, embedded=False, recording=False)
    stepped = anhyst.Loop(anhyst.Scenario(scenarios / "milling.ron", SHORT))
    stepped.run()
    assert processes.digest == embedded.digest == stepped.digest
    assert len(list((processes.folder / "processes").glob("*.json"))) > 3


def test_recorded_tokens_are_those_of_the_loop(scenarios):
    run = anhyst.run(scenarios / "milling.ron", set=SHORT)
    stepped = anhyst.Loop(run.scenario).run()
    tokens = run.tokens
    assert set(tokens) == set(stepped)
    for channel in tokens:
        for field, own in stepped[channel].items():
            np.testing.assert_array_equal(tokens[channel][field], own, err_msg=f"{channel}.{field}")
    assert tokens["measurement"]["tick"].dtype == np.uint64
    assert np.diff(tokens.time_s()).mean() == pytest.approx(run.scenario.tick_s)


def test_a_copy_of_a_loop_goes_on_as_its_original(scenarios):
    one = anhyst.Loop(anhyst.Scenario(scenarios / "milling.ron", SHORT))
    one.run(500)
    other = one.copy()
    np.testing.assert_array_equal(one.run(100)["truth"]["displacement_m"], other.run(100)["truth"]["displacement_m"])
    assert one.digest == other.digest


def test_plant_and_controller_side_by_side_are_the_loop(scenarios):
    scenario = anhyst.Scenario(scenarios / "milling.ron", SHORT)
    plant, controller = anhyst.Plant(scenario), anhyst.Controller(scenario)
    whole = anhyst.Loop(scenario).run(400)
    for tick in range(400):
        measured = plant.measurement
        assert measured["displacement_m"] == whole["measurement"]["displacement_m"][tick]
        field = controller.step(**measured)
        assert field == whole["safe_field"]["field_a_per_m"][tick]
        plant.step(field)


def test_an_estimator_over_arrays_is_that_of_the_loop(scenarios):
    scenario = anhyst.Scenario(scenarios / "milling.ron", SHORT)
    whole = anhyst.Loop(scenario).run(1000)
    measured = whole["measurement"]
    estimator = anhyst.Estimator(scenario)
    found = estimator.run(whole["safe_field"]["field_a_per_m"], measured["displacement_m"], measured["coil_field_a_per_m"])
    for field, own in found.items():
        np.testing.assert_array_equal(own, whole["estimate"][field], err_msg=field)
    assert np.ptp(found["shape_a_per_m"]) > 0.0


@pytest.mark.parametrize(
    "words, ask",
    [
        (["check", "none.ron"], lambda: anhyst.check("none.ron")),
        (["run", "none.ron"], lambda: anhyst.run("none.ron")),
        (
            ["run", "built-in/milling.ron", "--set=controller.feedback.kp=-1.0"],
            lambda: anhyst.run("built-in/milling.ron", set={"controller.feedback.kp": -1.0}),
        ),
        (
            ["run", "built-in/milling.ron", "--set=controller.gain=1"],
            lambda: anhyst.Scenario("built-in/milling.ron").set(controller__gain=1),
        ),
        (["fit", "--data=none.csv", "--law=nonsense"], lambda: anhyst.fit("none.csv", law="nonsense")),
        (["predict", "--model=none.ron", "--data=none.csv"], lambda: anhyst.predict("none.ron", "none.csv")),
    ],
)
def test_a_refusal_is_the_command_lines_sentence(words, ask, executable):
    told = command_line(executable, *words)
    assert told.returncode == 2
    with pytest.raises(anhyst.BadInput) as refused:
        ask()
    assert isinstance(refused.value, ValueError)
    # The command line's has a frame, and clap's its own head; the words are the same.
    flat = lambda text: " ".join(text.replace("×", "").split())
    assert flat(str(refused.value)) in flat(told.stderr)


def test_nothing_is_printed(scenarios, capfd):
    anhyst.run(scenarios / "milling.ron", set=SHORT, recording=False)
    with pytest.raises(anhyst.BadInput):
        anhyst.run("none.ron")
    assert capfd.readouterr() == ("", "")


def test_the_command_line_of_the_package(scenarios, executable):
    here = subprocess.run(
        [sys.executable, "-m", "anhyst", "graph", str(scenarios / "milling.ron")], capture_output=True, text=True
    )
    there = command_line(executable, "graph", scenarios / "milling.ron")
    assert (here.returncode, here.stdout, here.stderr) == (there.returncode, there.stdout, there.stderr)
    wrong = subprocess.run([sys.executable, "-m", "anhyst", "chekc"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "chekc" in wrong.stderr


def test_ctrl_c_ends_a_run_and_leaves_python_alive(scenarios):
    path = str(scenarios / "milling.ron")
    program = f"""
import anhyst
try:
    anhyst.run({path!r}, set={{"duration_s": 1000.0}}, embedded=EMBEDDED, recording=False)
except KeyboardInterrupt:
    run = anhyst.run({path!r}, set={SHORT}, recording=False)
    print("went on", run.summary["ticks"])
"""
    for embedded in (True, False):
        words = [sys.executable, "-c", program.replace("EMBEDDED", str(embedded))]
        child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        while not list(pathlib.Path("runs").glob("*/scenario.ron")) and child.poll() is None:
            time.sleep(0.1)
        time.sleep(2.0)
        child.send_signal(signal.SIGINT)
        assert child.communicate(timeout=600)[0] == "went on 4000\n", f"embedded={embedded}"
        shutil.rmtree("runs")


def test_ctrl_c_gives_up_a_fit_and_leaves_python_alive(tmp_path):
    program = """
import anhyst, numpy, pathlib
phase = numpy.linspace(0.0, 400.0, 60000)
table = {"time_s": 1e-3 * numpy.arange(60000), "voltage_V": 50 * numpy.sin(phase) * numpy.sin(0.03 * phase)}
table["displacement_um"] = 0.1 * table["voltage_V"] + numpy.sin(phase - 0.3)
print("begins", flush=True)
try:
    anhyst.fit(table, law="auto", out="given-up")
except KeyboardInterrupt:
    # Heard at the end, it would have its results.
    assert not pathlib.Path("given-up/law.ron").exists()
    fitted = anhyst.fit_law(table["voltage_V"][:400], table["displacement_um"][:400], law="prandtl-ishlinskii")
    print("went on", fitted.law is not None)
"""
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "begins\n"
    time.sleep(3.0)
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=600)[0] == "went on True\n"


def test_the_children_of_a_run_import_nothing_from_where_it_is_run(scenarios, tmp_path):
    (tmp_path / "json.py").write_text("raise SystemExit('this is not the json module')\n")
    run = anhyst.run(scenarios / "milling.ron", set=SHORT, embedded=False, recording=False)
    assert run.summary["ticks"] == 4000
    assert os.path.exists(run.report)
