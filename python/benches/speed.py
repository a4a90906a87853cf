"""How long a sample takes from Python, over arrays of a thousand: the best of many, ns. Use: speed.py"""

import timeit

import numpy as np

import anhyst

x = 12e3 * np.sin(np.linspace(0.0, 20.0, 1000))
terfenol = anhyst.Material.terfenol_d()
laws = {
    "8 plays": anhyst.Law.prandtl_ishlinskii(np.linspace(0.0, 2e3, 8), np.ones(8)),
    "Preisach of 40 rows": anhyst.Law.preisach_lorentz(1.0, 1e3, 2e3, 15e3, rows=40),
    "Bouc-Wen": anhyst.Law.bouc_wen(1.0, 3e3),
    "domain wall": terfenol.law,
}


def best(work, repeats=30):
    return f"{1e6 * min(timeit.repeat(work, number=1, repeat=repeats)):.0f} ns"


for name, law in laws.items():
    wanted = law.copy().run(0.5 * x)
    inverse = best(lambda: law.invert(wanted, 2e4), 8)
    print(f"{name}: run {best(lambda: law.run(x))}, step {best(lambda: [law.step(own) for own in x])}, invert {inverse}")
rod, bank = anhyst.Rod(1.3724e-2, 7889.9, 6.4251e7, 5e-5), anhyst.Bank(terfenol, np.linspace(6300.0, 7300.0, 33))
loop = anhyst.Loop(anhyst.Scenario("built-in/milling.ron"))
print(f"rod: run {best(lambda: rod.run(x))}; bank of 33: run {best(lambda: bank.run(x))}; loop: run {best(lambda: loop.run(1000))}")
