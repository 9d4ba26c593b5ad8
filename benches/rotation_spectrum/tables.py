"""The tables, one function each: a Bench in, Markdown out."""

import json
import os
import shutil
import subprocess
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

import bundles
import judge
import spectra
from pages import table


class Bench:
    """The bundles, and what several tables need of them, computed once."""

    def __init__(self, options, made):
        self.options, self.bundles = options, made
        for bundle in made.values():
            if bundle.energy is None:
                # An older program: the field computed here instead.
                self.project_here(bundle)
        self.spectra = {name: spectra.spectrum(bundle) for name, bundle in made.items()}

    @staticmethod
    def project_here(bundle):
        found = [spectra.project(bundle, spectra.rotation_field(bundle, shape)) for run in bundles.shapes(bundle, every_state=True) for shape in run]
        bundle.rho_states, bundle.energy_states = np.array([rho for rho, _ in found]), np.array([energy for _, energy in found])
        last = np.flatnonzero(np.r_[bundle.states.run.to_numpy()[1:] != bundle.states.run.to_numpy()[:-1], True])
        bundle.rho, bundle.energy = bundle.rho_states[last], bundle.energy_states[last]

    @cached_property
    def shapes(self):
        return {name: bundles.shapes(bundle) for name, bundle in self.bundles.items() if "joined" not in name}

    def variant(self, name, change, eigenpairs=500):
        """A bundle written anew as files, changed, and taken through the whole program. `change`: (vertices, shapes,
        triangles) to the same, in the new order or frame."""
        bundle = self.bundles[name]
        folder = os.path.join(self.options.scratch, "variant")
        shutil.rmtree(folder, ignore_errors=True)
        vertices, shapes, triangles = change(bundle.vertices.copy(), self.shapes[name].copy(), bundle.triangles.astype(int))
        for run, shape in zip(bundle.runs, shapes):
            bundles.write_family(os.path.join(folder, "runs", run), vertices, triangles, [(0.0, vertices), (1.0, shape)])
        with open(os.path.join(folder, "labels.csv"), "w") as file:
            rows = zip(bundle.runs, bundle.label, bundle.clear)
            file.write("run,label,clear\n" + "".join(f"{run},{label},{str(clear).lower()}\n" for run, label, clear in rows))
        made = bundles.make(self.options.program, "of a variant", folder + "/runs", folder + "/labels.csv", self.options.scratch, bundle.fold, None, eigenpairs)
        if made.energy is None:
            self.project_here(made)
        return made


def per_mode(found):
    return " / ".join(f"{values.mean():.3f}" for values in found.values())


def worst_mode(similarity, bundle):
    """The smallest mean average precision of a mode: on all runs, on clear ones."""
    return [min(values.mean() for values in judge.queries(similarity, bundle, clear).values()) for clear in (False, True)]


def product(points):
    return points @ points.T


def ranking(bench):
    rows = []
    for name, bundle in bench.bundles.items():
        methods = {
            "paper's descriptor of the query": spectra.paper_similarities(bundle),
            "25 numbers, centred by the bundle": product(spectra.centred_25(bundle)),
            "25 numbers, plain": product(spectra.plain_25(bundle)),
            "kind alone": product(spectra.unit(spectra.kind(bundle, bundle.rho, bundle.energy))),
            "**rotation spectrum**": product(bench.spectra[name]),
        }
        for method, similarity in methods.items():
            rows.append([f"{name}: {', '.join(bundle.modes)}" if method.startswith("paper") else "", method]
                        + [per_mode(judge.queries(similarity, bundle, clear)) for clear in (False, True)])
    return table(["bundle: modes", "compared by", "all", "clear"], rows)


def certainty(bench):
    rows = []
    for name, bundle in bench.bundles.items():
        similarity = product(bench.spectra[name])
        every, clear = judge.queries(similarity, bundle), judge.queries(similarity, bundle, True)
        at_nine = judge.precision_at_9(similarity, bundle)
        for mode in bundle.modes:
            members = [run for run, label in zip(bundle.runs, bundle.label) if label == mode]
            cell = lambda found: "{:.3f} ({:.3f} … {:.3f})".format(found.mean(), *judge.interval(found))
            worst = int(np.argmin(every[mode]))
            rows.append([f"{name}: {mode}", len(members), cell(every[mode]), cell(clear[mode]), f"{every[mode][worst]:.3f} {members[worst]}",
                         f"{at_nine[mode][0]:.2f}", f"{at_nine[mode][1]:.3f}"])
    return table(["bundle: mode", "queries", "all", "clear", "worst query", "P@9 of the medoid", "mean P@9"], rows)


def modes(bench):
    rows = []
    for name, bundle in bench.bundles.items():
        for label, points in [("rotation spectrum", bench.spectra[name]), ("25 numbers, centred", spectra.centred_25(bundle)),
                              ("displacement, first 500", bundle.delta.reshape(len(bundle.runs), -1))]:
            found = judge.groups(points, bundle)
            cells = [f"{found[method][0]}: {found[method][1]:.2f}" for method in ("k-means", "Ward", "HDBSCAN")]
            rows.append([f"{name} ({len(bundle.modes)} modes)" if label.startswith("rotation") else "", label, *cells, "{} + {}".format(*found["HDBSCAN"][2])])
    return table(["bundle", "runs alike by", "k-means", "Ward", "HDBSCAN", "left out by HDBSCAN: labelled + mixed"], rows)


def independence(bench):
    rows = []
    for name, bundle in bench.bundles.items():
        subsets = [np.random.default_rng(seed).permutation(len(bundle.runs))[len(bundle.runs) // 3 :] for seed in range(100)]
        subsets += [np.flatnonzero(bundle.label != mode) for mode in bundle.modes]
        cells = []
        for make in (lambda rows: spectra.spectrum(bundle, bundle.rho[rows], bundle.energy[rows]), lambda rows: spectra.centred_25(bundle, bundle.rho[rows])):
            whole = product(make(np.arange(len(bundle.runs))))
            moved = [np.abs(product(make(rows)) - whole[np.ix_(rows, rows)]) for rows in subsets]
            cells += [f"{max(one.max() for one in moved[:100]):.2g}", f"{max(one.max() for one in moved[100:]):.2g}"]
        rows.append([name, *cells])
    return table(["bundle", "rotation spectrum: a third left out", "a mode left out", "25 numbers, centred: a third left out", "a mode left out"], rows)


def carried(source, target):
    """Spectra of the runs of one study in the basis of another mesh of the same part: kind as it is, direction by C."""
    bound = 16 * (np.pi / spectra.part_length(target)) ** 2
    low, high = source.eigenvalues < bound, target.eigenvalues < bound
    nearest = cKDTree(source.vertices).query(target.vertices)[1]
    matrix = (target.eigenvectors[high] * target.mass) @ source.eigenvectors[low][:, nearest].T
    rho = np.zeros((len(source.rho), len(target.eigenvalues), 3))
    rho[:, high] = np.einsum("ij,sjc->sic", matrix, source.rho[:, low])
    return spectra.unit(np.hstack([spectra.kind(source, source.rho, source.energy), spectra.direction(target, rho, source.energy)]))


def meshes(bench):
    names = [name for name in bench.bundles if name.startswith("hat")]
    rows = []
    for source in names:
        for target in names:
            if len(names) == 4 or source != target:
                one, other = bench.bundles[source], bench.bundles[target]
                points = bench.spectra[source] if source == target else carried(one, other)
                found = [judge.queries(points @ bench.spectra[target].T, one, clear, targets=None if source == target else other) for clear in (False, True)]
                rows.append([source, target, *map(per_mode, found), f"{np.mean([v.mean() for v in found[0].values()]):.3f}"])
    return table(["query from", "searched", "all", "clear", "mean of the modes"], rows)


def structures(bench):
    kinds = {name: spectra.unit(spectra.kind(bundle, bundle.rho, bundle.energy)) for name, bundle in bench.bundles.items()}
    rows = []
    for source, one in bench.bundles.items():
        cells = []
        for target, other in bench.bundles.items():
            found = [judge.queries(kinds[source] @ kinds[target].T, one, clear, None if source == target else other, one.fold, other.fold)[one.fold].mean() for clear in (False, True)]
            cells.append("{:.3f} / {:.3f}".format(*found))
        rows.append([f"{source}: {one.fold}", *cells])
    return table(["query from \\ searched"] + list(bench.bundles), rows)


def changes(bench):
    """What must not matter: files changed, the whole program run on them."""
    random = np.random.default_rng(7)
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))

    def noise(vertices, shapes, triangles):
        size = np.sqrt(((shapes - vertices) ** 2).sum(2).mean(1) / 3)[:, None, None]
        return vertices, shapes + 0.01 * size * random.standard_normal(shapes.shape), triangles

    def frame(vertices, shapes, triangles):
        shift = 3 * np.ptp(vertices)
        return vertices @ turn.T + shift, shapes @ turn.T + shift, triangles

    def moved(vertices, shapes, triangles):
        """Only the deformed shapes: each run's part has moved rigidly, up to half a turn, on top of its deformation."""
        turns = np.array([spectra.mean_rotation(random.standard_normal((1, 3, 3)), np.ones(1)) for _ in shapes])
        return vertices, np.einsum("sij,snj->sni", turns, shapes) + np.ptp(vertices), triangles

    def renumbered(vertices, shapes, triangles):
        order = random.permutation(len(vertices))
        place = np.argsort(order)
        return vertices[order], shapes[:, order], place[triangles][random.permutation(len(triangles))]

    def mirrored(vertices, shapes, triangles):
        mirror = np.array([1.0, -1.0, 1.0])
        return vertices * mirror, shapes * mirror, triangles[:, ::-1]

    rows = []
    for name in [name for name in bench.bundles if "joined" not in name]:
        same = worst_mode(product(bench.spectra[name]), bench.bundles[name])
        rows.append([name, "as it is", "", *(f"{x:.3f}" for x in same)])
        for word, change, pairs in [("noise of 1 % of the displacement", noise, 500), ("another frame", frame, 500), ("shapes moved rigidly", moved, 500),
                                    ("renumbered", renumbered, 500), ("mirrored", mirrored, 500), ("K = 300", None, 300), ("K = 200", None, 200), ("K = 100", None, 100)]:
            if change:
                points = spectra.spectrum(bench.variant(name, change))
            else:
                points = spectra.spectrum(bench.bundles[name], eigenpairs=pairs)
            moves = np.abs(product(points) - product(bench.spectra[name])).max()
            rows.append(["", word, f"{moves:.2g}", *(f"{x:.3f}" for x in worst_mode(product(points), bench.bundles[name]))])
    return table(["bundle", "change", "largest move of a similarity", "worst mode, all", "worst mode, clear"], rows)


def early(bench):
    rows = []
    for name, bundle in bench.bundles.items():
        points = spectra.spectrum(bundle, bundle.rho_states, bundle.energy_states)
        points[bundle.energy_states < 1e-8 * bundle.area] = 0
        numbers = bundle.states.groupby("run").cumcount().to_numpy()
        run = bundle.states.run.to_numpy()
        final = bench.spectra[name]
        medoids = []
        for mode in bundle.modes:
            members = np.flatnonzero(bundle.clear & (bundle.label == mode))
            medoids.append(members[np.argmax(product(final[members]).mean(1))])
        for number in range(1, numbers.max() + 1):
            at = np.array([np.flatnonzero((run == one) & (numbers == number))[0] for one in bundle.runs])
            similarity = points[at] @ final.T
            mode = np.array(bundle.modes)[np.argmax(similarity[:, medoids], axis=1)]
            labelled = bundle.label != "mixed"
            right = [(mode == bundle.label)[chosen].mean() for chosen in (labelled, labelled & bundle.clear)]
            means = [np.mean([values.mean() for values in judge.queries(similarity, bundle, clear).values()]) for clear in (False, True)]
            turn = np.sqrt(np.median(bundle.energy_states[at]) / bundle.area)
            rows.append([name if number == 1 else "", f"{np.median(bundle.states.time.to_numpy()[at]):.3g}", f"{turn:.3f}", *(f"{x:.3f}" for x in right + means)])
    return table(["bundle", "time", "median turn (RMS sine)", "nearest medoid right, all", "clear", "mean AP, all", "clear"], rows)


def choices(bench):
    """Every choice of the definition, one at a time."""
    def rows_of(word, make):
        cells = []
        for name, bundle in bench.bundles.items():
            if "joined" not in name:
                cells.append("{:.3f} / {:.3f}".format(*worst_mode(product(make(bundle)), bundle)))
        return [word, *cells]

    spectrum = spectra.spectrum
    options = {"**as defined**": {}}
    for octaves in (6, 7, 8, 10, 11):
        options[f"{octaves} octaves from 1"] = {"kinds": {"octaves": octaves}}
    options["10 octaves from ½"] = {"kinds": {"octaves": 10, "first": -1}}
    options["8 octaves from 2"] = {"kinds": {"octaves": 8, "first": 1}}
    options["share of each octave instead of the cumulative"] = {"kinds": {"what": "bands"}}
    options["its root (amplitude) instead"] = {"kinds": {"what": "bands", "power": 0.5}}
    options["root of the cumulative share"] = {"kinds": {"power": 0.5}}
    options["square of the cumulative share"] = {"kinds": {"power": 2.0}}
    options["no reference"] = {"kinds": {"reference": "none"}}
    options["reference: half in every octave"] = {"kinds": {"reference": "half"}}
    for weight in (0.5, 0.7, 0.85, 1.15, 1.4, 2.0):
        options[f"direction weighs {weight}"] = {"weight": weight}
    options["direction: fades over 1 octave of λ"] = {"span": 1.0}
    options["direction: fades over 4 octaves of λ"] = {"span": 4.0}
    rows = [rows_of(word, lambda bundle, chosen=chosen: spectrum(bundle, **chosen)) for word, chosen in options.items()]
    rows.append(rows_of("the missing energy beyond all octaves", lambda bundle: spectrum(bundle, kinds={"rest": False})))
    rows.append(rows_of("the same, K = 100", lambda bundle: spectrum(bundle, eigenpairs=100, kinds={"rest": False})))
    captured = lambda bundle: spectrum(bundle, energy=(bundle.rho**2).sum((1, 2)))
    rows.append(rows_of("energy of the K eigenvectors, not of the field", captured))
    rows.append(rows_of("the same, K = 100", lambda bundle: spectrum(bundle, bundle.rho[:, :100], (bundle.rho[:, :100] ** 2).sum((1, 2)))))
    rows.append(rows_of("kind alone", lambda bundle: spectrum(bundle, weight=0.0)))
    rows.append(rows_of("direction alone", lambda bundle: spectra.unit(spectra.direction(bundle, bundle.rho, bundle.energy))))
    return table(["choice", *[name for name in bench.bundles if "joined" not in name]], rows)


def functions(bench):
    """The same spectrum of other functions on the surface."""
    found = {}
    for name, bundle in bench.bundles.items():
        if "joined" in name:
            continue
        each = [spectra.fields(bundle, shape) for shape in bench.shapes[name]]
        for word in each[0]:
            projected = [spectra.project(bundle, one[word]) for one in each]
            points = spectra.spectrum(bundle, np.array([rho for rho, _ in projected]), np.array([energy for _, energy in projected]))
            found.setdefault(word, {})[name] = "{:.3f} / {:.3f}".format(*worst_mode(product(points), bundle))
    names = [name for name in bench.bundles if "joined" not in name]
    return table(["function", *names], [[word, *(cells[name] for name in names)] for word, cells in found.items()])


def program(bench):
    """The similarities that `crumple search` prints against those of this bench, for the first run of each label."""
    pairs = [(name, name) for name in bench.bundles] + [("hat", "hat, joined"), ("hat", "hat, fine"), ("hat, fine", "hat")]
    rows = []
    for source, target in pairs:
        if target not in bench.bundles or source not in bench.bundles:
            continue
        one, other = bench.bundles[source], bench.bundles[target]
        points = bench.spectra[source] if source == target else carried(one, other)
        options = [] if source == target else ["--from", one.study]
        queries = [int(np.flatnonzero(one.label == label)[0]) for label in sorted(set(one.label))]
        moved = []
        for query in queries:
            arguments = [bench.options.program, "--quiet", "--json", "search", other.study, one.runs[query], "--top", str(len(other.runs)), *options]
            found = json.loads(subprocess.run(arguments, check=True, capture_output=True).stdout)["results"]
            printed = {hit["run"]: hit["similarity"] for hit in found}
            ours = bench.spectra[target] @ points[query]
            moved.append(max(abs(printed[run] - ours[at]) for at, run in enumerate(other.runs)))
        rows.append([source, target, len(queries), f"{max(moved):.2g}"])
    return table(["query from", "searched", "queries", "largest difference"], rows)


TABLES = {
    "program": program,
    "ranking": ranking,
    "certainty": certainty,
    "modes": modes,
    "independence": independence,
    "meshes": meshes,
    "structures": structures,
    "early states": early,
    "choices": choices,
    "functions": functions,
    "changes": changes,
}
