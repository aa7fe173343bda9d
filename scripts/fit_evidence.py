#!/usr/bin/env python3
"""Fits the weights of EvidenceParams (core/include/scanloc/core/auto_params.hpp) to what
evidence_dump wrote, from those of today.

  fit_evidence.py [--indoors] [--steps N] [--seed N] [--set NAME=VALUE]... answers.csv...

Needs numpy. Random steps that make it better are kept: the mean over all kinds of the share of
queries that are localized and right, less 0.03 for each wrong answer that nearly is, less the
calibration error of all and the mean of that of each kind that was taken within the map. Then
prints the weights and, for each kind, how many are localized and right of those that have a right
spot, the wrong ones that are localized, the greatest confidence of a wrong one and the calibration
error. --steps 0 judges the weights as they are. Kinds that end in x are scans from elsewhere; a
number in a kind's name is its seed, and does not count as part of it.
"""
import argparse
import csv
import re

import numpy as np

OUTDOORS = dict(bias=-11.2, score=15.0, sharpness=15.6, over_mirror=17.8, contradicted=-4.2,
                chance=-7.2, inliers=0.0, rival=40.0, beside=100.0, equal_scores=0.02,
                equal_by_chance=0.5, alike_score=0.65, equal_of_mirror=1.0, cohort=0.0,
                cohort_surely=0.0, max_over_mirror=0.3, inliers_share=0.0, equal_floors=0.15,
                max_unseen=0.5, sure_of_little=0.98, equal_in_cohort=1.0, cohort_lead=0.0)
INDOORS = dict(bias=-19.0, score=17.6, sharpness=20.0, over_mirror=20.6, contradicted=-40.0,
               chance=-29.7, inliers=12.8, rival=250.0, beside=250.0, equal_scores=0.08,
               equal_by_chance=0.15, alike_score=0.85, equal_of_mirror=0.5, cohort=1.2,
               cohort_surely=0.8, max_over_mirror=0.25, inliers_share=0.4, equal_floors=0.15,
               max_unseen=0.5, sure_of_little=1.0, equal_in_cohort=0.5, cohort_lead=1.0)
# What is searched: how far a step goes, and the range.
STEPS = dict(bias=(1.5, -40, 0), score=(2.5, 0, 60), sharpness=(3, 0, 60), over_mirror=(4, 0, 60),
             contradicted=(4, -40, 0), chance=(12, -150, 0), inliers=(2.5, 0, 60),
             rival=(15, 20, 250), beside=(10, 20, 250), equal_scores=(0.01, 0.02, 0.15),
             equal_by_chance=(0.1, 0.1, 1), alike_score=(0.03, 0.6, 1), cohort=(0.4, 0, 5),
             cohort_surely=(0.5, 0, 3))
# As in EvidenceParams.
MAX_SHARPNESS, MAX_INLIERS, LEAST_INLIERS, BEYOND_INLIERS = 0.2, 0.5, 0.3, 40.0
EQUAL_OF_ALIKE, COHORT_SHARE, COHORT_SIZE = 1.0, 0.7, 6
UNDECIDED, LOCALIZED = 0.799, 0.8
MAX_SPOTS = 24


def logistic(log_odds):
    return 1.0 / (1.0 + np.exp(-np.clip(log_odds, -60.0, 60.0)))


def log_odds_of(p):
    p = np.clip(p, 1e-9, 1.0 - 1e-9)
    return np.log(p / (1.0 - p))


class Answers:
    def __init__(self, files):
        rows = []
        for name in files:
            with open(name, newline="", encoding="utf-8") as file:
                rows += list(csv.DictReader(file))
        self.columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]
                        if name not in ("kind", "spots")}
        self.kinds = np.array([re.sub(r"\d+", "", row["kind"]) for row in rows])
        self.is_within = ~np.char.endswith(self.kinds, "x")
        spots = np.full((len(rows), MAX_SPOTS, 4), -9.0)
        for of, row in zip(spots, rows):
            told = [spot.split(":") for spot in row["spots"].split()[:MAX_SPOTS]]
            of[:len(told)] = np.array(told, float)
        self.score = spots[:, :, 3]
        self.right = spots[:, 0, 0] == 1.0
        self.has_right = (spots[:, :, 0] == 1.0).any(1)
        self.is_above = spots[:, :, 1] == 1.0
        self.is_usual = spots[:, :, 2] == 1.0

    def read(self, w, literally):
        """As `read` in evidence.cpp's Confidences; of the best spot."""
        of = self.columns
        chance = 1.0 / np.sqrt(np.maximum(of["num_posts"], 1.0))
        equal = w["equal_scores"] + w["equal_by_chance"] * chance
        by_chance = 0.0 if literally else equal

        def rivalry(better, score, share=1.0, remains=1.0):
            alike = 0.0 if literally else EQUAL_OF_ALIKE * np.maximum(score - w["alike_score"], 0.0)
            lead = better - score - share * alike
            return w["rival"] * np.maximum((lead.T - share * remains * by_chance).T, 0.0)

        log_odds = (w["bias"] + w["score"] * of["score"] + w["contradicted"] * of["contradicted"] +
                    w["sharpness"] * np.minimum(of["sharpness"], MAX_SHARPNESS) +
                    w["over_mirror"] * np.minimum(of["over_mirror"], w["max_over_mirror"]) +
                    w["inliers"] * np.minimum(of["inliers"], MAX_INLIERS) + w["chance"] * chance)
        if w["inliers_share"] > 0.0:
            exactly = np.maximum(of["inliers"] - LEAST_INLIERS, 0.0)
            log_odds = np.minimum(log_odds, BEYOND_INLIERS * exactly)
        best, others = self.score[:, 0], self.score[:, 1:]
        alike = (others >= COHORT_SHARE * best[:, None]) & self.is_usual[:, 1:] & \
            ~self.is_above[:, 1:]
        cohort = np.clip(2.0 * alike.sum(1) / COHORT_SIZE - 1.0, 0.0, 1.0)
        large_cohort = np.clip(alike.sum(1) / COHORT_SIZE - 1.0, 0.0, 1.0)
        better = of["score"] + w["inliers_share"] * (of["inliers"] - of["score"])
        of_cohort = w["cohort" if literally else "cohort_surely"] * cohort
        remains = 1.0 - large_cohort * (1.0 - w["equal_in_cohort"])
        ahead = best - others.max(1) - remains * equal
        of_cohort += np.clip(w["rival"] * ahead, 0.0, large_cohort * w["cohort_lead"])
        genuine = np.minimum(log_odds + of_cohort,
                             rivalry(better, better - of["over_mirror_exactly"],
                                     w["equal_of_mirror"]))
        beside = np.maximum(of["sharpness"] - by_chance, 0.0)
        genuine = np.minimum(genuine, w["beside"] * beside)
        others = np.minimum(others + w["equal_floors"] * self.is_above[:, 1:], best[:, None])
        rivals = np.exp(-rivalry(best[:, None] + 0.0 * others, others, 1.0, remains))
        rivals *= others >= 0.0
        return logistic(genuine) / (1.0 + rivals.sum(1))

    def confidences(self, w):
        cautious = self.read(w, False)
        told = np.minimum(self.read(w, True), UNDECIDED)
        p = np.maximum(cautious, told)
        narrow = (self.columns["unseen"] > w["max_unseen"]) & (p < w["sure_of_little"])
        return np.where(narrow, np.minimum(p, UNDECIDED), p)

    def error(self, p, of):
        index = np.minimum((p[of] * 10).astype(int), 9)
        off = np.bincount(index, p[of] - self.right[of], 10)
        return np.abs(off).sum() / max(1, of.sum())

    def worth(self, w):
        p = self.confidences(w)
        log_odds = log_odds_of(p)
        found = logistic((log_odds - log_odds_of(LOCALIZED)) / 0.25) * self.right
        kinds = [self.kinds == kind for kind in sorted(set(self.kinds[self.is_within]))]
        shares = [found[of].sum() / max(1, self.has_right[of].sum()) for of in kinds]
        surely = log_odds_of(self.read(w, False))
        wrong = (logistic((surely - 1.2) / 0.2) * ~self.right).sum()
        errors = [self.error(p, of) for of in kinds]
        return np.mean(shares) - 0.03 * wrong - np.mean(errors) - self.error(p, p >= 0.0)

    def tell(self, w):
        p = self.confidences(w)
        print(f"differs from what was told by at most {abs(p - self.columns['confidence']).max():.3f}")
        for kind in ["all", *sorted(set(self.kinds))]:
            of = (self.kinds == kind) | (kind == "all")
            wrong = p[of & ~self.right]
            print(f"  {kind:16} {of.sum():6} answers, localized and right "
                  f"{(p[of & self.right] >= LOCALIZED).sum() / max(1, self.has_right[of].sum()):.3f}"
                  f", false {(wrong >= LOCALIZED).sum()} of {len(wrong)}, greatest wrong "
                  f"{wrong.max(initial=0.0):.2f}, calibration error {self.error(p, of):.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--indoors", action="store_true")
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    weights = dict(INDOORS if options.indoors else OUTDOORS)
    for text in options.set:
        name, value = text.split("=")
        weights[name] = float(value)
    answers = Answers(options.files)
    random = np.random.default_rng(options.seed)
    names = [name for name in STEPS if weights[name] != 0.0]
    best = answers.worth(weights) if options.steps else 0.0
    for _ in range(options.steps):
        tried = dict(weights)
        for name in random.choice(names, random.integers(1, 4), replace=False):
            step, least, most = STEPS[name]
            tried[name] = float(np.clip(tried[name] + step * random.normal(), least, most))
        worth = answers.worth(tried)
        if worth > best:
            best, weights = worth, tried
    print("weights: " + ", ".join(f"{name} {weights[name]:.3g}" for name in STEPS))
    answers.tell(weights)


if __name__ == "__main__":
    main()
