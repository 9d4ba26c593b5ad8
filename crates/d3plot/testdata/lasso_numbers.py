#!/usr/bin/env python3
"""Numbers of another reader for tests of agreement: python3 lasso_numbers.py --shared FOLDER > lasso_numbers.json

Needs lasso-python 2.0.4 (`pip install lasso-python==2.0.4`) and NumPy. Reads the families below this folder that lasso-python
reads rightly, and of FOLDER (`../shared/data`) every real family and every run of the hat-section bundles. Of every array that the
crate reads, too, [count, least, largest, sum, weighted sum] over all states; the weights, 1 to 97 and again, tell whether the values stand in
the same order. Where a family has rigid shells, lasso-python leaves them out.
"""
import importlib.metadata
import json
import os
import sys

import numpy as np
from lasso.dyna import D3plot

HERE = os.path.dirname(os.path.abspath(__file__))
# those of the synthetic families that it reads rightly (docs/reading.md), and real ones
FAMILIES = ["s01_shells_latin1", "s02_double_solids", "s04_gaps_in_numbers", "s07_temperature_mass", "s08_rigid_shells",
            "s09_cut_in_state", "s12_node_deletion", "x07_particles", "x12_unknown_title", "lasso_beamip", "lasso_order",
            "lasso_solid_int"]
SHARED = ["d3plot/ansys_beam_gap", "d3plot/ansys_bird_strike_gap", "d3plot/ansys_projectile_gap", "d3plot/ansys_solid",
          "d3plot/lasso_node_temperature", "d3plot/lasso_simple"]
BUNDLES = ["hat-section", "hat-section-fine"]
# arrays of states: our names and theirs
STATES = {
    "coordinates": "node_displacement",  # positions, whatever its name says
    "velocity": "node_velocity", "acceleration": "node_acceleration", "temperature": "node_temperature",
    "heat_flux": "node_heat_flux", "mass_scaling": "node_mass_scaling", "temperature_rate": "node_temperature_gradient",
    "residual_force": "node_residual_forces", "residual_moment": "node_residual_moments",
    "solid_stress": "element_solid_stress", "solid_plastic_strain": "element_solid_effective_plastic_strain",
    "solid_history": "element_solid_history_variables", "solid_strain": "element_solid_strain",
    "beam_axial_force": "element_beam_axial_force", "beam_shear_force": "element_beam_shear_force",
    "beam_bending_moment": "element_beam_bending_moment", "beam_torsion_moment": "element_beam_torsion_moment",
    "beam_shear_stress": "element_beam_shear_stress", "beam_axial_stress": "element_beam_axial_stress",
    "beam_plastic_strain": "element_beam_plastic_strain", "beam_axial_strain": "element_beam_axial_strain",
    "shell_stress": "element_shell_stress", "shell_plastic_strain": "element_shell_effective_plastic_strain",
    "shell_history": "element_shell_history_vars", "shell_bending_moment": "element_shell_bending_moment",
    "shell_shear_force": "element_shell_shear_force", "shell_normal_force": "element_shell_normal_force",
    "shell_thickness": "element_shell_thickness", "shell_element_variable": "element_shell_unknown_variables",
    "shell_strain": "element_shell_strain", "shell_internal_energy": "element_shell_internal_energy",
}
# joined to the words of a state again, as far as it names them; of particles, those behind the first, which it changes
GLOBALS = ["global_kinetic_energy", "global_internal_energy", "global_total_energy", "global_velocity", "part_internal_energy",
           "part_kinetic_energy", "part_velocity", "part_mass", "part_hourglass_energy"]
SPH = ["sph_radius", "sph_pressure", "sph_stress", "sph_effective_plastic_strain", "sph_density",
       "sph_internal_energy", "sph_n_neighbors", "sph_strain", "sph_strainrate", "sph_mass"]
# it takes words of the plastic strain tensor (IDTDT 100 with ten layers) for strains
MISREAD = {"d3plot/ansys_bird_strike_gap": ("shell_strain", "shell_internal_energy")}
ALIVE = {"deleted_nodes": "node_is_alive", "deleted_solids": "element_solid_is_alive", "deleted_shells": "element_shell_is_alive",
         "deleted_beams": "element_beam_is_alive"}
MESH = {"initial_coordinates": "node_coordinates", "node_ids": "node_ids", "solid_ids": "element_solid_ids",
        "beam_ids": "element_beam_ids", "shell_ids": "element_shell_ids", "solid_nodes": "element_solid_node_indexes",
        "shell_nodes": "element_shell_node_indexes", "beam_nodes": "element_beam_node_indexes",
        "solid_parts": "element_solid_part_indexes", "shell_parts": "element_shell_part_indexes",
        "beam_parts": "element_beam_part_indexes", "sph_nodes": "sph_node_indexes"}


def numbers(array):
    a = np.asarray(array, np.float64).ravel()
    weights = np.arange(a.size) % 97 + 1
    # 15 digits: all that two ways of adding up can agree on
    return [a.size] + [float(f"{value:.15g}") for value in (a.min(), a.max(), a.sum(), (a * weights).sum())]


def family(path, only=None, misread=()):
    arrays = D3plot(os.path.join(path, "d3plot")).arrays
    times = np.asarray(arrays["timesteps"], np.float64)
    out = {"times": numbers(times)}
    if only is None:
        out["part_ids"] = [int(i) for i in arrays.get("part_ids", [])]
        for name, theirs in MESH.items():
            if theirs in arrays and arrays[theirs].size:
                array = arrays[theirs]
                out[name] = numbers(array[:, :2] if name == "beam_nodes" else array)
        for name, theirs in ALIVE.items():
            if theirs in arrays:
                out[name] = [int(dead) for dead in (np.asarray(arrays[theirs]) == 0).sum(-1)]
        if "sph_radius" in arrays:
            # states, particles, words
            parts = [np.asarray(arrays[name], np.float64) for name in SPH]
            out["sph"] = numbers(np.concatenate([a if a.ndim > 2 else a[..., None] for a in parts], axis=-1))
    for name, theirs in STATES.items():
        if theirs in arrays and arrays[theirs].size and name not in misread and (only is None or name in only):
            out[name] = numbers(arrays[theirs])
    out["globals"] = numbers(np.concatenate([np.asarray(arrays[name], np.float64).reshape(len(times), -1)
                                             for name in GLOBALS if name in arrays], axis=1))
    return out


if __name__ == "__main__":
    out = {"lasso-python": importlib.metadata.version("lasso-python"), "numpy": np.__version__}
    out["families"] = {name: family(os.path.join(HERE, name)) for name in FAMILIES}
    if "--shared" in sys.argv:
        shared = sys.argv[sys.argv.index("--shared") + 1]
        out["shared"] = {name: family(os.path.join(shared, name), misread=MISREAD.get(name, ())) for name in SHARED}
        for bundle in BUNDLES:
            runs = sorted(name for name in os.listdir(os.path.join(shared, bundle)) if name.startswith("run_"))
            out["shared"].update({f"{bundle}/{run}": family(os.path.join(shared, bundle, run), None if run == runs[0] else
                                                            ("coordinates", "shell_plastic_strain")) for run in runs})
    print("{")
    for key, value in out.items():
        if isinstance(value, dict):
            lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(numbers, separators=(',', ':'))}" for name, numbers in value.items())
            print(f"{json.dumps(key)}: {{\n{lines}\n}}{',' if key != list(out)[-1] else ''}")
        else:
            print(f"{json.dumps(key)}: {json.dumps(value)},")
    print("}")
