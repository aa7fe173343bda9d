#!/usr/bin/env python3
"""Draws a query on the scans of the mapped drive around it, from above: as it was answered, and as it is.

  draw_answer.py MAP_DRIVE QUERY_DRIVE ANSWERS.csv QUERY OUT.svg [HALF_WIDTH_M]

Drives are folders of `scanloc simulate`; the answers are those of `scanloc locate MAP --scans QUERY_DRIVE
--truth QUERY_DRIVE/poses.txt --csv ANSWERS.csv`, QUERY is the name of a scan. What stands 0.3 to 3 m above
the ground is drawn: grey what was mapped within 6 m, blue the query. Only the standard library.
"""
import csv
import math
import sys
from array import array
from pathlib import Path

CELL_M = 0.2
PIXELS = 460


def poses(drive):
    rows = [list(map(float, line.split())) for line in (drive / "poses.txt").read_text().splitlines()]
    return [(row[0:3] + row[4:7] + row[8:11], (row[3], row[7], row[11])) for row in rows]


def scans(drive):
    return sorted((drive / "velodyne").iterdir())


def seen_from(scan, pose, ground_m, center, half_m):
    """The cells around the center in which something stands."""
    numbers = array("f", scan.read_bytes())
    r, t = pose
    cells = set()
    for i in range(0, len(numbers), 4):
        x, y, z = numbers[i:i + 3]
        high = r[6] * x + r[7] * y + r[8] * z + t[2] - ground_m
        if not 0.3 < high < 3.0:
            continue
        u = r[0] * x + r[1] * y + r[2] * z + t[0] - center[0]
        v = r[3] * x + r[4] * y + r[5] * z + t[1] - center[1]
        if abs(u) < half_m and abs(v) < half_m:
            cells.add((round(u / CELL_M), round(v / CELL_M)))
    return cells


def rotation(x, y, z, w):
    return [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]


def path(cells, color, half_m):
    scale = PIXELS / (2 * half_m)
    dots = "".join(f"M{(half_m + u * CELL_M) * scale:.0f} {(half_m - v * CELL_M) * scale:.0f}h2"
                   for u, v in sorted(cells))
    return f'<path d="{dots}" stroke="{color}" stroke-width="2" fill="none"/>'


def panel(title, mapped, query, pose, sensor_m, half_m):
    center, ground_m = pose[1], pose[1][2] - sensor_m
    place = set()
    for scan, at in mapped:
        if math.dist(at[1], center) < 6.0:
            place |= seen_from(scan, at, at[1][2] - sensor_m, center, half_m)
    own = seen_from(query, pose, ground_m, center, half_m)
    return (f'<text x="4" y="14">{title}</text><g transform="translate(0 20)">'
            f'<rect width="{PIXELS}" height="{PIXELS}" fill="none" stroke="#999"/>'
            f'{path(place, "#bbb", half_m)}{path(own, "#0072b2", half_m)}</g>')


def main():
    if len(sys.argv) not in (6, 7):
        sys.exit(__doc__)
    map_drive, query_drive, answers = map(Path, sys.argv[1:4])
    name, out = sys.argv[4:6]
    half_m = float(sys.argv[6]) if len(sys.argv) == 7 else 15.0
    with open(answers, newline="", encoding="utf-8") as file:
        row = next((r for r in csv.DictReader(file) if r["query"] == name), None)
    if row is None or not row["x"]:
        sys.exit(f"draw_answer: {answers} has no pose of {name}")
    queries = scans(query_drive)
    number = [scan.name for scan in queries].index(name)
    number_of = lambda *columns: [float(row[column]) for column in columns]
    answered = (rotation(*number_of("qx", "qy", "qz", "qw")), tuple(number_of("x", "y", "z")))
    sensor_m = min(pose[1][2] for pose in poses(map_drive))
    mapped = list(zip(scans(map_drive), poses(map_drive)))
    panels = [panel(f"answered: {row['outcome']}, {float(row['confidence']):.2f}", mapped, queries[number],
                    answered, sensor_m, half_m),
              panel(f"as it is, {float(row['error_m']):.1f} m from there", mapped, queries[number],
                    poses(query_drive)[number], sensor_m, half_m)]
    Path(out).write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * PIXELS + 20} {PIXELS + 22}" '
        'font-family="sans-serif" font-size="13"><rect width="100%" height="100%" fill="white"/>'
        f'{panels[0]}<g transform="translate({PIXELS + 20} 0)">{panels[1]}</g></svg>\n', encoding="utf-8")


if __name__ == "__main__":
    main()
