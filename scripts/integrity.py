#!/usr/bin/env python3
"""Asks maps of many kinds of worlds, and counts what is right, false or silent.

An answer is right within 1 m, 1 m of height and 10 degrees of heading, as `scanloc locate --truth`
judges it; false: localized and not right. recall@1: the best candidate is right, whatever the
outcome. Both shares are of the queries that were taken within the map. Only the standard library.
"""
import argparse
import csv
import hashlib
import math
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import integrity_sets
from integrity_sets import Ask, Case, Set

SCANLOC = os.environ["SCANLOC"]
STOREY_M = 1.5    # a mapped scan on another floor maps nothing here
SETTLED_M = 30.0  # from here on a walk is judged


def run(*args):
    done = subprocess.run([SCANLOC, *map(str, args)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"scanloc {' '.join(map(str, args))}\n{done.stderr}")


@dataclass
class Answer:
    query: str
    outcome: str
    confidence: float  # of the best candidate; None without one
    is_right: bool
    is_mapped: bool
    errors: str = ""


@dataclass
class Tally:
    answers: list = field(default_factory=list)

    def share(self, is_counted):
        mapped = [a for a in self.answers if a.is_mapped]
        return sum(map(is_counted, mapped)) / len(mapped) if mapped else None

    def count(self, outcome):
        return sum(a.outcome == outcome for a in self.answers)

    def false(self):
        return [a for a in self.answers if a.outcome == "localized" and not a.is_right]

    def calibration_error(self):
        told = [a for a in self.answers if a.confidence is not None]
        error = 0.0
        for low in range(10):
            bin_ = [a for a in told if min(9, int(a.confidence * 10)) == low]
            if bin_:
                error += abs(sum(a.confidence for a in bin_) - sum(a.is_right for a in bin_))
        return error / len(told) if told else None


def positions(poses_file):
    rows = (line.split() for line in Path(poses_file).read_text().splitlines() if line.strip())
    return [(float(r[3]), float(r[7]), float(r[11])) for r in rows]


def is_near(position, mapped, reach_m):
    x, y, z = position
    return any((x - a) ** 2 + (y - b) ** 2 <= reach_m ** 2 and abs(z - c) <= STOREY_M
               for a, b, c in mapped)


def sensor_height(drive):
    return drive[drive.index("--sensor-height-m") + 1]


def simulate(folder, drive):
    run("simulate", folder, *drive, "--threads", 1, "--quiet")


class Bench:
    """Where maps are made and asked."""

    def __init__(self, work, out):
        self.work, self.out = work, out
        self.pools = {}
        self.refused = []  # maps that were built only when told to accept them, and why

    def add_pool(self, name, drives, pool):
        folder = self.work / f"pool-{name}"
        folder.mkdir()

        def add(i):
            part = self.work / f"{name}-{i}"
            simulate(part, drives[i])
            for scan in sorted((part / "velodyne").iterdir()):
                scan.rename(folder / f"{i:03d}_{scan.name}")
            shutil.rmtree(part)
        list(pool.map(add, range(len(drives))))
        self.pools[name] = folder

    def measure(self, case):
        """All answers of a case; the scans of false ones are kept."""
        own = Path(tempfile.mkdtemp(dir=self.work))
        map_ = own / "map.scanloc"
        simulate(own / "map", case.mapped)
        self.build(case.name, map_, "--scans", own / "map", "--poses", own / "map/poses.txt",
                   "--sensor-height-m", sensor_height(case.mapped), "--quiet")
        mapped = positions(own / "map/poses.txt")
        shutil.rmtree(own / "map")
        answers = []
        for i, ask in enumerate(case.asks):
            folder = own / f"ask{i}"
            simulate(folder, ask.drive)
            answers += self.locate(case, map_, folder, mapped, ask)
            shutil.rmtree(folder)
        if case.pool:
            answers += self.locate(case, map_, self.pools[case.pool], mapped,
                                   Ask([], elsewhere=True))
        shutil.rmtree(own)
        return answers

    def build(self, name, map_, *args):
        """The poses are true: a build that calls them wrong is counted, and told to go on."""
        try:
            run("build", map_, *args)
        except RuntimeError as error:
            if "--accept-inconsistent" not in str(error):
                raise
            self.refused.append(f"{name}: {str(error).splitlines()[1]}")
            run("build", map_, *args, "--accept-inconsistent")

    def locate(self, case, map_, folder, mapped, ask, more=()):
        table = map_.parent / "answers.csv"
        told = [] if ask.elsewhere else ["--truth", folder / "poses.txt"]
        walk = ["--sequence", "--odometry", folder / "odometry.txt"] if ask.walk else []
        run("locate", map_, "--scans", folder, *told, *walk, *more, "--csv", table, "--quiet")
        with open(table, encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return self.judge(case, folder, mapped, ask, rows)

    def judge(self, case, folder, mapped, ask, rows):
        answers, walked, last = [], 0.0, None
        for row in rows:
            here = None if ask.elsewhere else (float(row["true_x"]), float(row["true_y"]))
            if ask.walk:
                walked += math.dist(here, last) if last else 0.0
                last = here
                if walked < SETTLED_M:
                    continue
            answers.append(self.answer(row, ask))
            if not ask.elsewhere:
                z = positions_cached(folder)[row["query"]]
                answers[-1].is_mapped = is_near((*here, z), mapped, case.reach_m)
            if answers[-1].outcome == "localized" and not answers[-1].is_right:
                self.keep(case, folder, row["query"], answers[-1])
        return answers

    @staticmethod
    def answer(row, ask):
        confidence = float(row["confidence"]) if row["confidence"] else None
        if ask.elsewhere:
            return Answer(row["query"], row["outcome"], confidence, False, False, "elsewhere")
        is_right = row["x"] != "" and row["missed"] == ""
        errors = row["missed"] and f"{row['missed']} by {float(row['error_m']):.2f} m, " \
            f"{float(row['height_error_m']):.2f} m, {float(row['yaw_error_deg']):.1f} deg"
        return Answer(row["query"], row["outcome"], confidence, is_right, True, errors)

    def keep(self, case, folder, query, answer):
        """The scan, named by its answer, where it can be looked at."""
        scans = folder / "velodyne" if (folder / "velodyne").is_dir() else folder
        if self.out is None:
            return
        kept = self.out / "false" / case.name.replace(" ", "-")
        kept.mkdir(parents=True, exist_ok=True)
        name = hashlib.sha1(f"{folder}{query}".encode()).hexdigest()[:6] + "-" + query
        shutil.copy(scans / query, kept / name)
        answer.query = str(kept / name)


_heights = {}


def positions_cached(folder):
    """Of each scan of a drive: its true height, by name."""
    if folder not in _heights:
        scans = folder / "velodyne" if (folder / "velodyne").is_dir() else folder
        names = sorted(s.name for s in scans.iterdir() if s.suffix in (".bin", ".pcd"))
        _heights[folder] = dict(zip(names, (p[2] for p in positions(folder / "poses.txt"))))
    return _heights[folder]


def real_drives(bench, data):
    """NCLT and KITTI, each also asked for the scans of the other."""
    nclt, kitti = data / "nclt-2013-01-10", data / "kitti-00-first-827m"
    if not (nclt.is_dir() and kitti.is_dir()):
        print(f"no real drives in {data}: NCLT and KITTI are left out", file=sys.stderr)
        return
    for title, own, other, built, asked in (
            ("NCLT, reverse revisits", nclt, kitti, ["--to", 467], ["--from", 468]),
            ("KITTI 00, odd frames", kitti, nclt, ["--every", 2], ["--every", 2, "--offset", 1])):
        folder = Path(tempfile.mkdtemp(dir=bench.work))
        map_ = folder / "map.scanloc"
        bench.build(title, map_, "--scans", own, "--poses", own / "poses.txt", "--spacing-m", 0,
                    *built, "--quiet")
        case = Case(title, [], [], 8.0)
        mapped = positions(own / "poses.txt")
        mapped = mapped[:468] if own is nclt else mapped[::2]
        answers = bench.locate(case, map_, own, mapped, Ask([]), asked)
        answers += bench.locate(case, map_, other, mapped, Ask([], elsewhere=True))
        shutil.rmtree(folder)
        yield title, answers


def text(value, decimals=3):
    return "–" if value is None else f"{value:.{decimals}f}"


def row(title, tally):
    cells = [title, len(tally.answers), sum(a.is_mapped for a in tally.answers),
             text(tally.share(lambda a: a.is_right)),
             text(tally.share(lambda a: a.is_right and a.outcome == "localized")),
             text(tally.share(lambda a: a.outcome == "ambiguous")),
             len(tally.false()), text(tally.calibration_error())]
    return "| " + " | ".join(map(str, cells)) + " |"


def main():
    parser = argparse.ArgumentParser(prog="scripts/integrity.sh", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="some 2,000 queries instead of 20,000")
    parser.add_argument("--sets", default="", help="only these, with commas between: " + ", ".join(
        [*integrity_sets.sets(True, 1), "real"]))
    parser.add_argument("--seed", type=int, default=1, help="of the first world of each kind")
    parser.add_argument("--out", type=Path, help="folder that gets the scans of false answers")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    known = integrity_sets.sets(options.quick, options.seed)
    chosen = options.sets.split(",") if options.sets else [*known, "real"]
    for name in chosen:
        if name not in known and name != "real":
            parser.error(f"no set is called {name}")

    total, false = Tally(), []
    print("| set | queries | of the map | recall@1 | localized and right | ambiguous | false | ECE "
          "|\n|---|---|---|---|---|---|---|---|", flush=True)

    def tell(title, answers):
        tally = Tally(answers)
        total.answers.extend(answers)
        print(row(title, tally), flush=True)
        false.extend((title, a) for a in tally.false())

    with tempfile.TemporaryDirectory() as work, ThreadPoolExecutor(options.jobs) as pool:
        bench = Bench(Path(work), options.out)
        for name in chosen:
            if name == "real":
                for title, answers in real_drives(bench, Path(os.environ["SCANLOC_DATA"])):
                    tell(title, answers)
                continue
            made = known[name]()
            for needed in sorted({c.pool for c in made.cases} - {"", *bench.pools}):
                bench.add_pool(needed, integrity_sets.pool(needed, options.quick, options.seed),
                               pool)
            measured = list(pool.map(bench.measure, made.cases))
            answers = [a for of_case in measured for a in of_case]
            if any(c.pool for c in made.cases):
                tell(made.title + ": scans from elsewhere",
                     [a for a in answers if a.errors == "elsewhere"])
                answers = [a for a in answers if a.errors != "elsewhere"]
                made.title += ": from within, furniture moved"
            tell(made.title, answers)
    print(row("**all**", total))
    if bench.refused:
        print(f"\n{len(bench.refused)} maps were refused, though their poses are true:\n")
    for refused in bench.refused:
        print(f"- {refused}")
    print(f"\n{len(false)} false answers" + (":\n" if false else "."))
    for title, answer in sorted(false, key=lambda f: -(f[1].confidence or 0)):
        print(f"- {answer.confidence:.4f} {title}: `{answer.query}`, {answer.errors}")


if __name__ == "__main__":
    main()
