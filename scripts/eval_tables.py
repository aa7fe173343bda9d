#!/usr/bin/env python3
"""Markdown tables of what `scanloc eval --json` wrote; only the standard library.

  eval_tables.py full TITLE FILE                all measures of one evaluation
  eval_tables.py summary MEASURES LABEL=FILE[,FILE...] ...
                                                a row a label, a column a method, means over files
  eval_tables.py groups MEASURES LABEL=FILE ... a row a label, MEASURES of each method side by side
  eval_tables.py candidates MEASURES FILE       a row a K, MEASURES of each method NAME:K
  eval_tables.py methods MEASURES FILE          a row a method, a column a measure
  eval_tables.py within MEASURES FILE           a row a method, MEASURES within each limit
  eval_tables.py times FILE                     a row a stage, a column a method

MEASURES: with commas between, of r1 r5 r10 auc f1 p r d p100 ep ece (p, r, d: precision, recall and
KL divergence at the greatest F1).
"""
import json
import sys

MEASURES = {
    "r1": ("recall@1", "recall_at_1"),
    "r5": ("recall@5", "recall_at_5"),
    "r10": ("recall@10", "recall_at_10"),
    "auc": ("AUC", "area_under_curve"),
    "f1": ("F1max", "f1_max"),
    "p": ("P", "precision_at_f1_max"),
    "r": ("R", "recall_at_f1_max"),
    "d": ("D", "divergence_at_f1_max"),
    "p100": ("R@P100", "recall_at_full_precision"),
    "ep": ("EP", "extended_precision"),
    "ece": ("ECE", "expected_calibration_error"),
}
KINDS = ["easy", "lateral", "rotational", "both"]


def number(value, decimals=3):
    return "-" if value is None else f"{value:.{decimals}f}"


def table(columns, rows):
    print("| " + " | ".join(columns) + " |")
    print("|" + "---|" * len(columns))
    for row in rows:
        print("| " + " | ".join(row) + " |")


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def chosen(names):
    unknown = [name for name in names.split(",") if name not in MEASURES]
    if unknown:
        sys.exit(f"eval_tables: no measure {unknown[0]}; there are {' '.join(MEASURES)}")
    return [MEASURES[name] for name in names.split(",")]


def labelled(arguments):
    for argument in arguments:
        label, _, paths = argument.rpartition("=")
        yield label, paths.split(",")


def main_results(document):
    return [r for r in document["results"] if r["within_m"] == document["within_m"]]


def errors(error):
    if error is None:
        return "-"
    return " / ".join(number(error[key], 2) for key in ("median", "mean", "p90"))


def full(title, path):
    document = load(path)
    results = main_results(document)
    kinds = [k for k in KINDS if results and results[0]["kinds"][k]["num_revisits"] > 0]
    of_kinds = kinds if len(kinds) > 1 else []
    counts = [f"{results[0]['kinds'][k]['num_revisits']} {k}" for k in kinds]
    print(
        f"\n{title}: {document['num_queries']} queries, {document['num_revisits']} revisits within "
        f"{document['within_m']:g} m ({', '.join(counts) or 'none'}), "
        f"{document['num_elsewhere']} taken elsewhere\n"
    )
    measures = chosen("r1,r5,r10,auc,f1,p100,ep")
    columns = ["method"] + [head for head, _ in measures] + ["KL"]
    columns += [f"KL {kind}" for kind in of_kinds]
    columns += ["ECE", "pos m", "lat m: median / mean / 90 %", "yaw °: median / mean / 90 %", "ms"]
    rows = []
    for result in results:
        row = [result["method"]] + [number(result[key]) for _, key in measures]
        row.append(number(result["divergence_at_f1_max"]))
        row += [number(result["kinds"][kind]["divergence_at_f1_max"]) for kind in of_kinds]
        row.append(number(result["expected_calibration_error"]))
        row.append(number(result["median_position_error_m"], 2))
        row += [errors(result["lateral_error_m"]), errors(result["yaw_error_deg"])]
        row.append(number(result["times_ms"]["total"], 2))
        rows.append(row)
    table(columns, rows)
    beyond = [f"{r['method']} {r['num_right_beyond']}" for r in results if r["num_right_beyond"]]
    if beyond:
        print(
            "\nOf the answers that count as wrong, so many tell the right pose, though no place "
            f"lies within {document['within_m']:g} m: {', '.join(beyond)}."
        )


def mean(values):
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def summary(names, arguments):
    measures = chosen(names)
    methods = []
    rows = []
    for label, paths in labelled(arguments):
        documents = [load(path) for path in paths]
        by_method = {}
        for document in documents:
            for result in main_results(document):
                by_method.setdefault(result["method"], []).append(result)
        methods += [name for name in by_method if name not in methods]
        rows.append((label, by_method))
    cells = [
        [label]
        + [
            " / ".join(number(mean(r[key] for r in by_method.get(m, [])), 2) for _, key in measures)
            for m in methods
        ]
        for label, by_method in rows
    ]
    print(f"\nEach: {' / '.join(head for head, _ in measures)}\n")
    table([""] + methods, cells)


def groups(names, arguments):
    measures = chosen(names)
    rows = []
    columns = []
    for label, paths in labelled(arguments):
        results = main_results(load(paths[0]))
        columns = [""] + [f"{r['method']} {head}" for r in results for head, _ in measures]
        rows.append([label] + [number(r[key]) for r in results for _, key in measures])
    table(columns, rows)


def candidates(names, path):
    measures = chosen(names)
    methods = []
    ks = []
    by_name = {}
    for result in main_results(load(path)):
        method, _, k = result["method"].partition(":")
        methods += [method] if method not in methods else []
        ks += [k] if k not in ks else []
        by_name[method, k] = result
    columns = ["k"] + [f"{method} {head}" for method in methods for head, _ in measures]
    rows = [
        [k or "all"]
        + [number(by_name.get((m, k), {}).get(key)) for m in methods for _, key in measures]
        for k in ks
    ]
    table(columns, rows)


def of_methods(names, path):
    measures = chosen(names)
    results = main_results(load(path))
    columns = ["method"] + [head for head, _ in measures]
    table(columns, [[r["method"]] + [number(r[key]) for _, key in measures] for r in results])


def within(names, path):
    measures = chosen(names)
    results = load(path)["results"]
    limits = list(dict.fromkeys(r["within_m"] for r in results))
    methods = list(dict.fromkeys(r["method"] for r in results))
    of = {(r["method"], r["within_m"]): r for r in results}
    columns = ["method"] + [f"{limit:g} m {head}" for limit in limits for head, _ in measures]
    rows = [
        [m] + [number(of[m, limit][key]) for limit in limits for _, key in measures]
        for m in methods
    ]
    rows.append(
        ["revisits"]
        + [str(of[methods[0], limit]["num_revisits"]) for limit in limits for _ in measures]
    )
    table(columns, rows)


def times(path):
    results = main_results(load(path))
    stages = [
        ("description of a query", "describe"),
        ("description of a place", "describe_place"),
        ("retrieval", "retrieve"),
        ("match", "match"),
        ("verification", "verify"),
        ("total of a query", "total"),
        ("total, 99 %", "total_p99"),
    ]
    columns = ["ms"] + [r["method"] for r in results]
    table(columns, [[s] + [number(r["times_ms"][key]) for r in results] for s, key in stages])


def main():
    commands = {
        "full": lambda a: full(a[0], a[1]),
        "summary": lambda a: summary(a[0], a[1:]),
        "groups": lambda a: groups(a[0], a[1:]),
        "candidates": lambda a: candidates(a[0], a[1]),
        "methods": lambda a: of_methods(a[0], a[1]),
        "within": lambda a: within(a[0], a[1]),
        "times": lambda a: times(a[0]),
    }
    if len(sys.argv) < 3 or sys.argv[1] not in commands:
        sys.exit(__doc__)
    commands[sys.argv[1]](sys.argv[2:])


if __name__ == "__main__":
    main()
