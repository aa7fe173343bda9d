#!/usr/bin/env python3
"""Fits the weights of EvidenceParams (core/include/scanloc/core/auto_params.hpp) to what
evidence_dump wrote.

  fit_evidence.py [--wrong N] [--judge WEIGHTS] [--rival WEIGHT] [--alike SCORE] [--by-chance N]
                  [--max-over-mirror SCORE] answers.csv...

Needs numpy. A wrong answer counts N times [1]; the last four are EvidenceParams::rival, alike_score,
equal_by_chance and max_over_mirror [those of scale 1]. Prints the weights, then for each kind of
data how many of the right answers would be localized, the wrong ones that would be, the greatest
confidence of a wrong one and the calibration error; and the same with that kind left out of the
fit. Each kind weighs as the root of its number. With --judge nothing is fitted: WEIGHTS, as many
numbers between commas, are judged.
"""
import argparse
import csv

import numpy as np

FEATURES = ("1", "score", "sharpness", "over_mirror", "contradicted", "1/sqrt(num_posts)", "inliers")
# As in EvidenceParams.
MAX_SHARPNESS, MAX_INLIERS = 0.2, 0.5
LEAST_INLIERS, BEYOND_INLIERS = 0.3, 40.0
EQUAL_SCORES, EQUAL_OF_ALIKE = 0.02, 1.0
LOCALIZED = 0.8


def rivalry(better, score, chance, options):
    """As RivalryLogOdds in evidence.cpp."""
    equal = EQUAL_SCORES + options.by_chance * chance + EQUAL_OF_ALIKE * np.maximum(
        score - options.alike, 0.0)
    return options.rival * np.maximum(better - score - equal, 0.0)


def read(options):
    rows = []
    for name in options.files:
        with open(name, newline="", encoding="utf-8") as file:
            rows += list(csv.DictReader(file))
    column = lambda name: np.array([float(row[name]) for row in rows])
    chance = 1.0 / np.sqrt(column("num_posts"))
    features = np.stack([np.ones(len(rows)), column("score"),
                         np.minimum(column("sharpness"), MAX_SHARPNESS),
                         np.minimum(column("over_mirror"), options.max_over_mirror),
                         column("contradicted"), chance,
                         np.clip(column("inliers"), 0.0, MAX_INLIERS)], 1)
    share = 1.0 / (1.0 + np.exp(-rivalry(column("best"), column("rival"), chance, options)))
    best = column("best")
    genuine = rivalry(best, best - column("over_mirror_exactly"), chance, options)
    # -1: they were not looked at.
    exactly = BEYOND_INLIERS * np.maximum(column("inliers") - LEAST_INLIERS, 0.0)
    genuine = np.where(column("inliers") < 0.0, genuine, np.minimum(genuine, exactly))
    return features, share, genuine, column("right"), np.array([row["kind"] for row in rows])


def confidence(features, share, genuine, b):
    return share / (1.0 + np.exp(-np.minimum(features @ b, genuine)))


def fit(features, share, genuine, right, weight, steps=4000):
    """Greatest likelihood of logistic(min(features · b, genuine)) · share, by Adam, in features of
    mean 0 and deviation 1."""
    center, width = features.mean(0), features.std(0)
    center[0], width[0] = 0.0, 1.0
    scaled = (features - center) / np.maximum(width, 1e-9)
    b = np.zeros(len(FEATURES))
    mean, square = np.zeros_like(b), np.zeros_like(b)
    for step in range(1, steps + 1):
        supported = 1.0 / (1.0 + np.exp(-scaled @ b))
        p = np.clip(supported * share, 1e-9, 1.0 - 1e-9)
        slope = weight * (p - right) / (p * (1.0 - p)) * share * supported * (1.0 - supported)
        slope *= scaled @ b < genuine
        gradient = scaled.T @ slope / weight.sum() + 2e-5 * b
        mean = 0.9 * mean + 0.1 * gradient
        square = 0.999 * square + 0.001 * gradient**2
        pace = 0.05 if step < 0.6 * steps else 0.01
        b -= pace * (mean / (1.0 - 0.9**step)) / (np.sqrt(square / (1.0 - 0.999**step)) + 1e-9)
    b /= np.maximum(width, 1e-9)
    b[0] -= center @ b
    return b


def calibration_error(p, right, bins=10):
    index = np.minimum((p * bins).astype(int), bins - 1)
    return sum(abs((p[index == i] - right[index == i]).sum()) for i in range(bins)) / len(p)


def tell(name, p, right):
    is_right, is_wrong = right == 1.0, right == 0.0
    localized = p >= LOCALIZED
    print(f"  {name:24} {len(p):5} answers, right and localized "
          f"{localized[is_right].mean() if is_right.any() else 0.0:.3f}, false "
          f"{int(localized[is_wrong].sum())}, greatest wrong "
          f"{p[is_wrong].max() if is_wrong.any() else 0.0:.2f}, calibration error "
          f"{calibration_error(p, right):.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wrong", type=float, default=1.0)
    parser.add_argument("--rival", type=float, default=40.0)
    parser.add_argument("--alike", type=float, default=0.65)
    parser.add_argument("--by-chance", type=float, default=0.5)
    parser.add_argument("--max-over-mirror", type=float, default=0.3)
    parser.add_argument("--judge",
                        type=lambda text: np.array([float(word) for word in text.split(",")]))
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    features, share, genuine, right, kind = read(options)
    weight = np.zeros(len(right))
    for name in set(kind):
        weight[kind == name] = 1.0 / np.sqrt((kind == name).sum())
    weight[right == 0.0] *= options.wrong
    is_fit = options.judge is None
    b = fit(features, share, genuine, right, weight) if is_fit else options.judge
    print("weights: " + ", ".join(f"{name} {value:.1f}" for name, value in zip(FEATURES, b)))
    p = confidence(features, share, genuine, b)
    tell("all", p, right)
    for name in sorted(set(kind)):
        of = kind == name
        tell(name, p[of], right[of])
        if not is_fit:
            continue
        others = fit(features[~of], share[~of], genuine[~of], right[~of], weight[~of], steps=2000)
        tell("  left out of the fit", confidence(features, share, genuine, others)[of], right[of])


if __name__ == "__main__":
    main()
