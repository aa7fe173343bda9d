#!/usr/bin/env python3
"""clang-tidy over the files given, as many at a time as there are processors. A file that was found
clean is not looked at again until it, a header that it includes, its compile command, .clang-tidy or
clang-tidy itself changes; what was found clean stands in $XDG_CACHE_HOME/scanloc-lint (or ~/.cache).

  scripts/lint.py BUILD_DIR FILE...      exits with 1 if anything is found
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import shlex
import subprocess
import sys
import time

CLEAN = b"clean\n"
KEPT_S = 60 * 24 * 3600


def cache_dir():
    base = os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache"
    return pathlib.Path(base) / "scanloc-lint"


def included_files(command):
    """What the compiler reads for this compile command, the file itself first."""
    words = shlex.split(command["command"])
    output = words.index("-o")
    words = words[:output] + words[output + 2 :]
    made = subprocess.run(
        words + ["-M", "-MT", "x"], cwd=command["directory"], capture_output=True, text=True
    )
    if made.returncode != 0:
        return None
    return shlex.split(made.stdout.replace("\\\n", " "))[1:]


def key_of(command, root, build, common, digests):
    """A hash of all that clang-tidy's verdict depends on; None if the file does not compile. Paths
    in the checkout count from its root, so that checkouts share verdicts."""
    files = included_files(command)
    if files is None:
        return None
    key = hashlib.sha256(common)

    def plain(text):
        return text.replace(str(build), "<build>").replace(str(root), "<root>").encode()

    key.update(plain(command["command"]))
    for name in files:
        path = os.path.join(command["directory"], name)
        if path not in digests:
            digests[path] = hashlib.sha256(pathlib.Path(path).read_bytes()).digest()
        key.update(plain(os.path.realpath(path)) + digests[path])
    return key.hexdigest()


def look_at(file, build):
    """Whether clang-tidy finds nothing; what it finds is printed."""
    tidy = subprocess.run(
        ["clang-tidy", "--quiet", "-p", str(build), file],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    if tidy.returncode != 0:
        sys.stdout.write(tidy.stdout or tidy.stderr)
        sys.stdout.flush()
    return tidy.returncode == 0 and not tidy.stdout.strip()


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    root = pathlib.Path(__file__).resolve().parent.parent
    commands = {c["file"]: c for c in json.loads((build / "compile_commands.json").read_text())}
    version = subprocess.run(["clang-tidy", "--version"], capture_output=True, check=True).stdout
    common = version + (root / ".clang-tidy").read_bytes()
    known = cache_dir()
    known.mkdir(parents=True, exist_ok=True)
    for verdict in known.iterdir():
        if time.time() - verdict.stat().st_mtime > KEPT_S:
            verdict.unlink(missing_ok=True)
    digests = {}

    def lint(file):
        command = commands.get(str(pathlib.Path(file).resolve()))
        if command is None:
            print(f"{file}: no target compiles it; add it to one, or remove it")
            return file, False, False
        key = key_of(command, root, build, common, digests)
        if key is not None and (known / key).exists():
            (known / key).touch()
            return file, True, True
        is_clean = look_at(file, build)
        if is_clean and key is not None:
            (known / key).write_bytes(CLEAN)
        return file, is_clean, False

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(lint, sys.argv[2:]))
    bad = [file for file, is_clean, _ in results if not is_clean]
    num_known = sum(was_known for _, _, was_known in results)
    print(f"lint: {len(results)} files, {num_known} unchanged since they were found clean")
    if bad:
        print("lint: findings in " + " ".join(bad), file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
