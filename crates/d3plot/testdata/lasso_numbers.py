#!/usr/bin/env python3
"""Numbers of another reader for tests of agreement: python3 lasso_numbers.py > lasso_numbers.json

Needs lasso-python 2.0.4 (`pip install lasso-python==2.0.4`) and NumPy. Reads the families below this folder that
lasso-python reads rightly, and with `--shared FOLDER` the families of FOLDER as well. Minimum, maximum and sum of each
array are taken in 64-bit floats. Where a family has rigid shells, lasso-python leaves them out of the strains.
"""
import importlib.metadata
import json
import os
import sys

import numpy as np
from lasso.dyna import ArrayType, D3plot

HERE = os.path.dirname(os.path.abspath(__file__))
# those of the synthetic families that it reads rightly (README.md), and real ones
FAMILIES = ["s01_shells_latin1", "s02_double_solids", "s04_gaps_in_numbers", "s07_temperature_mass", "s08_rigid_shells",
            "s09_cut_in_state", "s12_node_deletion", "lasso_beamip", "lasso_order", "lasso_solid_int"]
SHARED = ["hat-section/run_001", "d3plot/lasso_simple", "d3plot/lasso_node_temperature", "d3plot/ansys_solid",
          "d3plot/ansys_bird_strike_gap", "d3plot/ansys_projectile_gap"]
ARRAYS = {
    "coordinates": ArrayType.node_displacement,  # positions, whatever its name says
    "velocity": ArrayType.node_velocity,
    "shell_plastic_strain": ArrayType.element_shell_effective_plastic_strain,
    "solid_plastic_strain": ArrayType.element_solid_effective_plastic_strain,
}
IDS = {"node_ids": ArrayType.node_ids, "shell_ids": ArrayType.element_shell_ids,
       "solid_ids": ArrayType.element_solid_ids, "beam_ids": ArrayType.element_beam_ids}


def numbers(a):
    a = np.asarray(a, np.float64)
    return {"count": int(a.size), "min": float(a.min()), "max": float(a.max()), "sum": float(a.sum())}


def family(path):
    arrays = D3plot(os.path.join(path, "d3plot")).arrays
    times = np.asarray(arrays[ArrayType.global_timesteps], np.float64)
    out = {"times": times.tolist(), "initial_coordinates": numbers(arrays[ArrayType.node_coordinates]),
           "part_ids": [int(i) for i in arrays.get(ArrayType.part_ids, [])]}
    for name, key in IDS.items():
        if key in arrays and len(arrays[key]):
            out[name] = numbers(arrays[key])
    out["states"] = [{name: numbers(arrays[key][k]) for name, key in ARRAYS.items()
                      if key in arrays and arrays[key][k].size} for k in range(len(times))]
    return out


if __name__ == "__main__":
    out = {"lasso-python": importlib.metadata.version("lasso-python"), "numpy": np.__version__}
    out["families"] = {n: family(os.path.join(HERE, n)) for n in FAMILIES}
    if "--shared" in sys.argv:
        shared = sys.argv[sys.argv.index("--shared") + 1]
        out["shared"] = {n: family(os.path.join(shared, n)) for n in SHARED}
    json.dump(out, sys.stdout, indent=0)
    print()
