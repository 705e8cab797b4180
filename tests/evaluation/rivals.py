"""Plain methods that correct the same tips: what the diagnosis has to be better than.

Each takes a Set, whose training rows it may use, and gives the tips at its test rows in mm. The
frames that a cell calls unknown are fitted by all of them, to the training rows, or to the alignment
rows where the test rows belong to another session.
"""

import json
import os
import subprocess

import numpy as np

import separability

CYCLES = [1, 2, 3, 4]


def unknown_frames(start=None):
    xyz = [{"name": n, "value": 0.0, "unit": "mm"} for n in "xyz"]
    angles = [{"name": n, "value": 0.0, "unit": "deg"} for n in ("roll", "pitch", "yaw")]
    base = {"id": "base_frame", "parameters": xyz + angles}
    if start is not None:
        for parameter, value in zip(base["parameters"], start):
            parameter["value"] = float(value)
    return [base, {"id": "tool_frame", "parameters": [dict(p) for p in xyz]}]


def rigid_start(tips, measured):
    """Translation [mm] and roll, pitch, yaw [deg] that lay the tips on the measured points."""
    a, b = tips - tips.mean(0), measured - measured.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    angles = [np.arctan2(turn[2, 1], turn[2, 2]), -np.arcsin(np.clip(turn[2, 0], -1, 1)),
              np.arctan2(turn[1, 0], turn[0, 0])]
    return np.concatenate([measured.mean(0) - turn @ tips.mean(0), np.degrees(angles)])


class Set:
    """Training, alignment (may be None) and test rows of one cell, as files in `folder`."""

    def __init__(self, simulate, folder, cell, train, test, align=None, unknown=False):
        self.simulate, self.folder, self.cell = simulate, folder, cell
        self.train, self.test, self.align, self.unknown = train, test, align, unknown
        self.rows = {name: separability.table(path) for name, path in
                     (("train", train), ("test", test), ("align", align)) if path}
        # What one part does not have, no method may learn from.
        self.recorded = set.intersection(*(set(rows[0]) for rows in self.rows.values()))
        self.measured = {name: np.array([[float(r[c]) for c in ("x_mm", "y_mm", "z_mm")] for r in rows])
                         for name, rows in self.rows.items() if "x_mm" in rows[0]}
        # The frames that hold for the training rows, and those for the test rows.
        self.frames = self.fit(train, self.start(train, "train"))[0] if unknown else []
        self.test_frames = self.fit(align, self.start(align, "align"))[0] if align else self.frames

    def run(self, *arguments):
        subprocess.run([self.simulate, "--cell", self.cell, *arguments], check=True, capture_output=True)

    def place(self, name):
        return os.path.join(self.folder, name)

    def write(self, effects):
        with open(self.place("with.json"), "w") as file:
            json.dump({"effects": effects}, file)
        return self.place("with.json")

    def tips(self, effects, path):
        self.run("--predict", "--with", self.write(effects), "--poses", path, "--out", self.place("tips"))
        return separability.points(self.place("tips"))

    def fit(self, path, form):
        """(fitted effects, tips at the test rows)"""
        self.run("--fit", "--with", self.write(form), "--measured", path, "--poses", self.test, "--out",
                 self.place("fit"))
        with open(self.place("fit.json")) as file:
            return json.load(file)["effects"], separability.points(self.place("fit"))

    def start(self, path, name):
        return unknown_frames(rigid_start(self.tips([], path), self.measured[name]))

    def columns(self, path, name, frames):
        """(columns of the effects, columns of the unknown frames), each (3 rows, parameters)"""
        self.run("--columns", "--measured", path, "--with", self.write(frames), "--out",
                 self.place("columns"), "--cycles", ",".join(map(str, CYCLES)))
        heads, values = separability.read_columns(self.place("columns"))
        blocks = separability.Blocks(heads, values, self.rows[name])
        frame = [h["id"] in ("base_frame", "tool_frame") for h in heads]
        effects = [v for v, f in zip(values, frame) if not f or not self.unknown]
        if "t_s" in self.recorded:
            effects += [c for tau in (600, 2400) for c in blocks.drift(tau).T]
        nuisances = [v for v, f in zip(values, frame) if f and self.unknown]
        return np.array(effects).T, np.array(nuisances).T if nuisances else np.zeros((values.shape[1], 0))

    def residual(self, path, name, frames):
        return (self.measured[name] - self.tips(frames, path)).ravel()

    def realigned(self, correct):
        """Tips at the test rows with `correct(columns, rows)` added and the frames refitted."""
        effects, frames = self.columns(self.test, "test", self.test_frames)
        change = correct(effects, self.rows["test"])
        if self.unknown:
            name, path = ("align", self.align) if self.align else ("train", self.train)
            at, beside = self.columns(path, name, self.test_frames)
            left = self.residual(path, name, self.test_frames) - correct(at, self.rows[name])
            scale = np.linalg.norm(beside, axis=0)
            change = change + frames @ (np.linalg.lstsq(beside / scale, left, rcond=1e-9)[0] / scale)
        return self.tips(self.test_frames, self.test) + change.reshape(-1, 3)


def declared(data):
    """Frames only."""
    return data.tips(data.test_frames, data.test)


def geometry(data):
    """All link parameters and joint offsets by least squares."""
    joints = sum(name.startswith("q") and name[1:-4].isdigit() and name.endswith("_deg")
                 for name in data.rows["train"][0])
    table = [{"name": f"{n}{i}", "value": 0.0, "unit": "deg" if n == "alpha" else "mm"}
             for i in range(1, joints + 1) for n in ("a", "d", "alpha")]
    offsets = [{"name": f"q{i}", "value": 0.0, "unit": "rad"} for i in range(1, joints + 1)]
    form = [{"id": "link_geometry", "parameters": table}, {"id": "joint_offset", "parameters": offsets}]
    frames = data.frames or unknown_frames()
    fitted, tips = data.fit(data.train, frames + form)
    if data.align:
        for effect in fitted[2:]:
            for parameter in effect["parameters"]:
                parameter["fixed"] = True
        tips = data.fit(data.align, data.test_frames + fitted[2:])[1]
    return tips


def penalised(data):
    """Scaled effect columns and residual of the training rows, unknown frames projected out."""
    columns, frames = data.columns(data.train, "train", data.frames)
    residual = data.residual(data.train, "train", data.frames)
    if frames.shape[1]:
        scaled = frames / np.linalg.norm(frames, axis=0)
        u, s, _ = np.linalg.svd(scaled, full_matrices=False)
        u = u[:, s > 1e-9 * s[0]]
        columns = columns - u @ (u.T @ columns)
        residual = residual - u @ (u.T @ residual)
    scale = np.linalg.norm(columns, axis=0) / np.sqrt(len(residual))
    scale[scale < 1e-6 * np.median(scale)] = np.inf  # a column that the frames imitate
    return columns / scale, residual, scale


def blocks_in_time(rows, folds=5):
    """Fold of each of the 3 rows' values: stretches of time, never neighbours apart."""
    return np.repeat(np.minimum(np.arange(rows) * folds // rows, folds - 1), 3)


def ridge(data):
    """Every effect at once, the strength by inner cross-validation over blocks of time."""
    columns, residual, scale = penalised(data)
    folds = blocks_in_time(len(residual) // 3)
    strengths = np.logspace(-6, 3, 28)

    def solutions(x, y):
        u, s, vt = np.linalg.svd(x, full_matrices=False)
        along = u.T @ y
        return [vt.T @ (s * along / (s * s + strength * len(y))) for strength in strengths]

    errors = np.zeros(len(strengths))
    for fold in range(5):
        out = folds == fold
        for i, solution in enumerate(solutions(columns[~out], residual[~out])):
            errors[i] += np.sum((residual[out] - columns[out] @ solution) ** 2)
    chosen = solutions(columns, residual)[int(np.argmin(errors))] / scale
    return data.realigned(lambda x, _: x @ chosen)


def lasso(data):
    """Every effect at once, the strength by inner cross-validation over blocks of time."""
    import warnings
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.linear_model import LassoCV
    from sklearn.model_selection import PredefinedSplit
    # Weak penalties may end before they converge; which is taken, held-out error decides all the same.
    warnings.simplefilter("ignore", ConvergenceWarning)
    columns, residual, scale = penalised(data)
    split = PredefinedSplit(blocks_in_time(len(residual) // 3))
    model = LassoCV(fit_intercept=False, cv=split, n_alphas=60, max_iter=3000, tol=1e-3)
    chosen = model.fit(columns, residual).coef_ / scale
    return data.realigned(lambda x, _: x @ chosen)


def features(rows, recorded):
    """Sine and cosine of the joints, their last moves' signs, and whatever else was recorded."""
    found = []
    for name in rows[0]:
        if name not in recorded - {"session", "x_mm", "y_mm", "z_mm"}:
            continue
        value = np.array([float(r[name]) for r in rows])
        if name.startswith("q") and name[1:-4].isdigit() and name.endswith("_deg"):
            moves = np.sign(np.diff(value, prepend=value[0]))
            found += [np.sin(np.radians(value)), np.cos(np.radians(value)), 0.5 * moves]
        else:
            found.append(value)
    return np.array(found).T


def standardised(data):
    x = features(data.rows["train"], data.recorded)
    middle, spread = x.mean(0), x.std(0)
    use = spread > 1e-9
    y = data.residual(data.train, "train", data.frames).reshape(-1, 3)
    return lambda rows: (features(rows, data.recorded)[:, use] - middle[use]) / spread[use], y


def gaussian_process(data):
    """A Gaussian process of each coordinate of the residual (length scale by feature; the kernel's
    parameters from at most 500 rows, the process from at most 3000)."""
    import warnings
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, RBF, WhiteKernel
    warnings.simplefilter("ignore", ConvergenceWarning)
    make, y = standardised(data)
    x = make(data.rows["train"])
    drawn = np.random.default_rng(1).permutation(len(x))
    some, most = drawn[:500], drawn[:3000]
    models = []
    for axis in range(3):
        spread = y[:, axis].std() or 1.0
        kernel = ConstantKernel(1.0) * RBF(np.full(x.shape[1], 3.0), (0.1, 1e3)) + WhiteKernel(0.1, (1e-8, 10))
        tuned = GaussianProcessRegressor(kernel, normalize_y=False).fit(x[some], y[some, axis] / spread)
        full = GaussianProcessRegressor(tuned.kernel_, optimizer=None).fit(x[most], y[most, axis] / spread)
        models.append((full, spread))
    return data.realigned(lambda _, rows: np.column_stack(
        [m.predict(make(rows)) * s for m, s in models]).ravel())


def boosted_trees(data):
    """Gradient-boosted trees for each coordinate of the residual."""
    from sklearn.ensemble import GradientBoostingRegressor
    make, y = standardised(data)
    x = make(data.rows["train"])
    models = [GradientBoostingRegressor(n_estimators=400, learning_rate=0.05, max_depth=4, subsample=0.7,
                                        min_samples_leaf=5, random_state=1).fit(x, y[:, a]) for a in range(3)]
    return data.realigned(lambda _, rows: np.column_stack([m.predict(make(rows)) for m in models]).ravel())


RIVALS = {"frames only": declared, "all geometry": geometry, "ridge": ridge, "lasso": lasso,
          "Gaussian process": gaussian_process, "boosted trees": boosted_trees}
