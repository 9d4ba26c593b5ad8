"""The thinnest sheet that still deforms as the descriptor says, by Optuna."""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import optuna

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from solver import NOTCH, THICKNESS, solve  # noqa: E402  put your own solver here


def distance(crumple, study, descriptor, folder):
    """1 - similarity of the run in a folder; a failed trial where there is no number."""
    words = [crumple, "distance", study, descriptor, str(folder), "--quiet"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise optuna.TrialPruned(done.stderr.strip())
    return float(done.stdout)


def main():
    """Runs the optimisation and prints the best design."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("study")
    arguments.add_argument("descriptor")
    arguments.add_argument("--trials", type=int, default=40)
    arguments.add_argument("--within", type=float, default=0.2, help="largest distance that is still the same mode")
    arguments.add_argument("--crumple", default="crumple", help="the program")
    given = arguments.parse_args()

    def objective(trial):
        thickness = trial.suggest_float("thickness_mm", *THICKNESS)
        notch = trial.suggest_float("notch_mm", *NOTCH)
        with tempfile.TemporaryDirectory() as folder:
            trial.set_user_attr("run", solve(thickness, notch, folder))
            found = distance(given.crumple, given.study, given.descriptor, folder)
        trial.set_user_attr("distance", found)
        trial.set_constraint("distance", found - given.within)
        return thickness

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
    study.optimize(objective, n_trials=given.trials)
    done = study.get_trials(states=[optuna.trial.TrialState.COMPLETE])
    kept = [trial for trial in done if trial.user_attrs["distance"] <= given.within]
    print(f"{len(study.trials)} trials, {len(done)} with a number, {len(kept)} within {given.within}")
    if not kept:
        sys.exit("no design is within; raise --within or --trials")
    best = min(kept, key=lambda trial: trial.value)
    print(
        f"thickness {best.params['thickness_mm']:.3f} mm, notch at {best.params['notch_mm']:.0f} mm, "
        f"distance {best.user_attrs['distance']:.4f} ({best.user_attrs['run']})"
    )


if __name__ == "__main__":
    main()
