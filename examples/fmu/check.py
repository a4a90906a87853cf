"""Validates the FMUs of a scenario with FMPy and drives them: states kept and set back, plant and controller side by side with the loop,
wrong input refused. Use: check.py FOLDER, with plant.fmu, inverse.fmu, controller.fmu and loop.fmu of one scenario in it."""
import math
import shutil
import sys

from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

folder, steps, logged = sys.argv[1], 4000, []


def start(kind):
    path = f"{folder}/{kind}.fmu"
    assert not validate_fmu(path), validate_fmu(path)
    told = read_model_description(path)
    place = extract(path)
    fmu = FMU3Slave(guid=told.guid, unzipDirectory=place, modelIdentifier="anhyst", instanceName=kind)
    fmu.instantiate(loggingOn=True)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    names = {own.name: own.valueReference for own in told.modelVariables}
    return fmu, names, place, float(told.defaultExperiment.stepSize)


units = {kind: start(kind) for kind in ("plant", "inverse", "controller", "loop")}
(plant, of_plant, _, tick), (control, of_control, _, _), (loop, of_loop, _, _) = (
    units[kind] for kind in ("plant", "controller", "loop"))
read = ["measurement.displacement_m", "measurement.coil_field_a_per_m", "measurement.temperature_k"]
truth = "truth.displacement_m"
kept = None
for k in range(steps):
    measured = plant.getFloat64([of_plant[name] for name in read])
    assert plant.getFloat64([of_plant[truth]]) == loop.getFloat64([of_loop[truth]]), f"tick {k}"
    control.setFloat64([of_control[name] for name in read], measured)
    control.doStep(k * tick, tick)
    field = control.getFloat64([of_control["safe_field.field_a_per_m"]])
    assert field == loop.getFloat64([of_loop["safe_field.field_a_per_m"]]), f"tick {k}"
    plant.setFloat64([of_plant["safe_field.field_a_per_m"]], field)
    plant.doStep(k * tick, tick)
    if k == steps // 2:
        kept = loop.getFMUState()
    loop.doStep(k * tick, tick)
end = loop.getFloat64([of_loop[truth], of_loop["tracking_error_m"]])
loop.setFMUState(kept)
for k in range(steps // 2, steps):
    loop.doStep(k * tick, tick)
assert loop.getFloat64([of_loop[truth], of_loop["tracking_error_m"]]) == end, "state"


def refused(call):
    try:
        call()
    except Exception:
        return
    raise AssertionError("not refused")


refused(lambda: plant.setFloat64([of_plant["safe_field.field_a_per_m"]], [math.nan]))
refused(lambda: plant.doStep(steps * tick, 0.5 * tick))
refused(lambda: plant.getFloat64([999999]))
refused(lambda: plant.setUInt64([of_plant["seed"]], [2]))
for fmu, _, place, _ in units.values():
    fmu.terminate()
    fmu.freeInstance()
    shutil.rmtree(place)
print(f"{steps} steps: plant and controller side by side have the loop's bits, its state goes on with the same bits, "
      f"{end[1]:.3e} m of tracking error at the end")
