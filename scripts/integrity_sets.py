"""The sets of queries that integrity.py asks: which worlds are mapped, and what is asked of them."""
from dataclasses import dataclass, field

# Sensors, with the height at which they are carried.
LOW = "--rays 16 --azimuths 900 --min-elevation-deg -15 --max-elevation-deg 15 --max-range-m 60 " \
      "--sensor-height-m 0.3".split()
MID = "--rays 32 --azimuths 720 --min-elevation-deg -25 --max-elevation-deg 25 --max-range-m 60 " \
      "--sensor-height-m 0.8".split()
CAR = "--rays 64 --azimuths 720 --sensor-height-m 1.8".split()
SOLID = "--rays 48 --azimuths 1600 --fov-deg 70 --min-elevation-deg -35 --max-elevation-deg 35 " \
        "--max-range-m 60 --sensor-height-m 0.8".split()
UP = "--rays 59 --azimuths 720 --min-elevation-deg -7 --max-elevation-deg 50 --max-range-m 40 " \
     "--sensor-height-m 0.4".split()


@dataclass
class Ask:
    """A drive that is looked up. `elsewhere`: of another world, so that every answer is wrong."""
    drive: list
    elsewhere: bool = False
    walk: bool = False  # by --sequence with odometry; judged from 30 m on


@dataclass
class Case:
    """A mapped drive and what is asked of it. Within reach_m of a mapped scan and on its floor, a
    query can be answered."""
    name: str
    mapped: list
    asks: list
    reach_m: float = 3.0
    pool: str = ""  # the scans from elsewhere that are asked, too: "low" or "mid"


@dataclass
class Set:
    title: str
    cases: list = field(default_factory=list)


def drive(world, seed, session, sensor, *more):
    return ["--world", world, "--world-seed", str(seed), "--session-seed", str(session), *sensor,
            *(str(m) for m in more)]


def towns(quick, seed):
    made = Set("towns")
    for s in range(seed, seed + (1 if quick else 4)):
        length = 500 if quick else 1200
        town = lambda session, *more: drive("town", s, session, CAR, "--length-m", length, *more)
        step = 8 if quick else 5
        made.cases.append(Case(f"town {s}", town(1, "--spacing-m", 2), [
            Ask(town(2, "--spacing-m", step)),
            Ask(town(3, "--spacing-m", step, "--reverse", "--lane-shift-m", 3.5, "--tilt-deg", 3)),
            Ask(drive("town", s + 900, 1, CAR, "--length-m", 300, "--spacing-m", 5), True)], 8.0))
    return made


def outdoors(quick, seed):
    made = Set("campus, forest")
    for s in range(seed, seed + (1 if quick else 3)):
        for world in ("campus", "forest"):
            at = lambda n, session, *more: drive(world, n, session, CAR, "--length-m",
                                                 300 if quick else 600, *more)
            made.cases.append(Case(f"{world} {s}", at(s, 1, "--spacing-m", 2), [
                Ask(at(s, 2, "--spacing-m", 6 if quick else 4)),
                Ask(at(s, 3, "--spacing-m", 6 if quick else 4, "--reverse")),
                Ask(at(s + 900, 1, "--spacing-m", 8), True)], 6.0))
    return made


def tunnels(quick, seed):
    made = Set("road tunnel")
    for s in range(seed, seed + (1 if quick else 3)):
        at = lambda n, session, *more: drive("tunnel", n, session, CAR, "--length-m",
                                             400 if quick else 800, *more)
        made.cases.append(Case(f"tunnel {s}", at(s, 1, "--spacing-m", 2), [
            Ask(at(s, 2, "--spacing-m", 5)), Ask(at(s, 3, "--spacing-m", 5, "--reverse")),
            Ask(at(s + 900, 1, "--spacing-m", 10), True)]))
    return made


def storeys(quick, seed, walk):
    made = Set("six alike floors and decks" + (", a walk in from outside" if walk else ""))
    for s in range(seed, seed + (1 if quick else 3)):
        for world, sensor, step in (("office", MID, 1.5), ("garage", CAR, 2.0)):
            at = lambda session, *more: drive(world, s, session, sensor, "--floors", 6,
                                              "--changed-share", 1, *more)
            ask = at(2, "--spacing-m", 1 if walk else 5 if quick else 3,
                     *(["--odometry-noise", 1] if walk else []),
                     *(["--to-m", 350] if walk and quick else []))
            made.cases.append(Case(f"{world} {s}", at(1, "--spacing-m", step),
                                   [Ask(ask, walk=walk)]))
    return made


RECTANGLES = (("room", MID, "mid", []), ("room", LOW, "low", []))
SINGLES = (("corner-room", MID, "mid", []), ("corner-room", LOW, "low", []),
           ("town", CAR, "mid", ["--length-m", 500, "--to-m", 1.5]),
           ("warehouse", MID, "mid", ["--aisles", 3, "--to-m", 40]))


def small(quick, seed, title, maps):
    """Maps that hold no rival: of a room, a place of a street, an aisle."""
    made = Set(title)
    for s in range(seed, seed + (2 if quick else 6)):
        for world, sensor, pool, part in maps:
            at = lambda session, step: drive(world, s, session, sensor, "--spacing-m", step, *part)
            mapped, asked = (1.5, 0.15) if world == "town" else (0.7, 0.7)
            made.cases.append(Case(f"{world} {s} {pool}", at(1, mapped),
                                   [Ask(at(2, asked)), Ask(at(3, asked))], pool=pool))
    return made


def halls(quick, seed):
    made = Set("symmetrical halls")
    for s in range(seed, seed + (3 if quick else 12)):
        at = lambda session, *more: drive("hall", s, session, MID, *more)
        made.cases.append(Case(f"hall {s}", at(1, "--spacing-m", 1, "--changed-share", 0.5), [
            Ask(at(2, "--spacing-m", 2, "--changed-share", 0.5)),
            Ask(at(3, "--spacing-m", 2, "--changed-share", 0.5, "--reverse"))]))
    return made


def low_robot(quick, seed):
    made = Set("office floor, home, low robot")
    for s in range(seed, seed + (2 if quick else 6)):
        for world in ("office", "home"):
            at = lambda n, session, *more: drive(world, n, session, LOW, "--floors", 1, *more)
            made.cases.append(Case(f"{world} {s}", at(s, 1, "--spacing-m", 0.7), [
                Ask(at(s, 2, "--spacing-m", 1.1, "--changed-share", 0.3)),
                Ask(at(s, 3, "--spacing-m", 1.1, "--changed-share", 0.3, "--reverse")),
                Ask(at(s + 900, 1, "--spacing-m", 3), True)], 2.0))
    return made


def warehouses(quick, seed):
    made = Set("warehouse of 20 alike aisles, some unmapped")
    for s in range(seed, seed + (1 if quick else 3)):
        for sensor, name in ((MID, "32 rays"), (LOW, "low robot"))[:1 if quick else 2]:
            at = lambda session, *more: drive("warehouse", s, session, sensor, *more)
            made.cases.append(Case(f"warehouse {s} {name}", at(1, "--spacing-m", 2, "--to-m", 750),
                                   [Ask(at(2, "--spacing-m", 8 if quick else 3)),
                                    Ask(at(3, "--spacing-m", 9 if quick else 5, "--reverse"))],
                                   2.0))
    return made


def mounts(quick, seed):
    made = Set("tilted, sideways and hanging mounts; 70 degrees of view")
    for s in range(seed, seed + (1 if quick else 2)):
        for world, part in (("office", ["--floors", 1]), ("town", ["--length-m", 400])):
            at = lambda session, sensor, *more: drive(
                world, s, session, sensor, "--spacing-m", 3 if quick else 2, *part, *more)
            turned = [Ask(at(2 + i, MID, "--mount-deg", mount)) for i, mount in
                      enumerate(("0,20,0", "0,45,0", "90,0,0", "180,0,0"))]
            made.cases.append(Case(f"{world} {s}", at(1, MID),
                                   turned + [Ask(at(9, SOLID))], 4.0))
    return made


def sensors(quick, seed):
    """Maps made by sensors that look up or see 70 degrees, and scans of others of their kind."""
    made = Set("maps by a sensor that looks up, or of 70 degrees")
    for s in range(seed, seed + (1 if quick else 3)):
        for world, part, step, asked in (("town", ["--length-m", 400], 2, 6),
                                         ("campus", ["--length-m", 300], 2, 6),
                                         ("hall", [], 1, 3), ("home", [], 0.7, 2),
                                         ("garage", ["--floors", 2], 2, 4)):
            for sensor, name in ((UP, "up"), (SOLID, "70 deg")):
                at = lambda n, session, *more: drive(world, n, session, sensor, *part, *more)
                made.cases.append(Case(f"{world} {s} {name}", at(s, 1, "--spacing-m", step), [
                    Ask(at(s, 2, "--spacing-m", asked)),
                    Ask(at(s, 3, "--spacing-m", asked, "--reverse")),
                    Ask(at(s + 900, 1, "--spacing-m", asked), True)], 4.0))
    return made


def pool(name, quick, seed):
    """Drives of other worlds than any that is mapped, by a sensor like that of the map."""
    sensor = {"low": LOW, "mid": MID}[name]
    step = 3.0 if quick else 1.5
    drives = []
    for s in range(seed + 500, seed + (502 if quick else 504)):
        for world, spacing in (("room", 1), ("home", 2), ("office", 4), ("hall", 2),
                               ("warehouse", 8), ("garage", 6), ("tunnel", 6), ("forest", 6),
                               ("campus", 6), ("town", 8)):
            drives.append(drive(world, s, 1, sensor, "--floors", 1, "--aisles", 4, "--length-m",
                                100, "--spacing-m", spacing * step))
    return drives


def sets(quick, seed):
    return {
        "towns": lambda: towns(quick, seed),
        "outdoors": lambda: outdoors(quick, seed),
        "tunnel": lambda: tunnels(quick, seed),
        "storeys": lambda: storeys(quick, seed, walk=False),
        "walks": lambda: storeys(quick, seed, walk=True),
        "small": lambda: small(quick, seed, "one room around a corner, one place, one aisle",
                               SINGLES),
        # Alike turned by half, but for what is built into a corner or two, and the furniture.
        "rectangles": lambda: small(quick, seed, "one rectangular room", RECTANGLES),
        "halls": lambda: halls(quick, seed),
        "low": lambda: low_robot(quick, seed),
        "warehouse": lambda: warehouses(quick, seed),
        "mounts": lambda: mounts(quick, seed),
        "sensors": lambda: sensors(quick, seed),
    }
