#!/usr/bin/env python3
"""Dakota's analysis driver: parameters in, thickness and distance out.

    driver.py params.in results.out

CRUMPLE, STUDY and DESCRIPTOR (environment) name the program, the study and what the design should become.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from solver import solve  # noqa: E402  put your own solver here


def parameters(path):
    """Dakota's standard format: a count, then `VALUE NAME` a line; what follows the variables is not read."""
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    count = int(re.match(r"\s*(\d+)\s+variables", lines[0])[1])
    pairs = (line.split()[:2] for line in lines[1 : count + 1])
    return {name: float(value) for value, name in pairs}


def main(parameters_file, results_file):
    """Runs one design."""
    design = parameters(parameters_file)
    job = Path(results_file).resolve().with_suffix(".run")
    solve(design["thickness_mm"], design["notch_mm"], job)
    crumple = os.environ.get("CRUMPLE", "crumple")
    words = [crumple, "distance", os.environ["STUDY"], os.environ["DESCRIPTOR"], str(job), "--quiet"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        results = f"{design['thickness_mm']:.10g} thickness\n{float(done.stdout):.10g} distance\n"
    else:
        print(done.stderr, file=sys.stderr)
        results = "FAIL\n"
    Path(results_file).write_text(results, encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:3])
