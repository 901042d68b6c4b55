#!/usr/bin/env python3
"""What a batch costs beside the work itself: many copies of a splat by a shell loop, and by `anchorsplat batch`.

    python scripts/measure-batch.py --splats 200 --repeat 3 [--method filter]

with the Python that has the package. Prints the shortest of the repetitions, so that other work on the machine counts less;
measure on a machine that has nothing else to do. With --manifest N: how long a manifest of N rows takes to read.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from anchorsplat.batch.engine import program
from anchorsplat.batch.manifest import Manifest

_WATCHED = 100  # splats of the runs that are watched for memory and processor time
EXAMPLE = Path(__file__).resolve().parent.parent / "examples/biplane/input.ply"


def tree_memory(root: int) -> int:
    """Bytes of a process and all below it; what several share is counted once."""
    parents = {}
    for process in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(process.name)] = int((process / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    total = 0
    for process in parents:
        above = process
        while above in parents and above != root:
            above = parents[above]
        if above != root:
            continue
        try:
            lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
            total += next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) * 1024
        except (OSError, StopIteration):
            continue
    return total


def tree_processor_time(root: int) -> float:
    """Seconds of processor that a process and those below it have used, without the splats' own programs."""
    stats = {}
    for process in Path("/proc").glob("[0-9]*"):
        try:
            name, fields = (process / "stat").read_text().split("(", 1)[1].rsplit(")", 1)
            stats[int(process.name)] = (name, fields.split())
        except OSError:
            continue
    total = 0.0
    for process, (name, fields) in stats.items():
        above = process
        while above in stats and above != root:
            above = int(stats[above][1][1])
        if above == root and name != program().name:
            total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def loop(inputs: Path, out: Path, options: list[str]) -> float:
    out.mkdir()
    words = " ".join(options)
    script = f'for f in "{inputs}"/*.ply; do "{program()}" enhance "$f" -o "{out}/$(basename "$f")" -q --threads 1 {words}; done'
    begin = time.perf_counter()
    subprocess.run(["sh", "-c", script], check=True, stderr=subprocess.DEVNULL)
    return time.perf_counter() - begin


def batch(inputs: Path, out: Path, workers: int, options: list[str], *, watched: bool = False) -> dict:
    """`watched`: also memory and processor time, which costs the machine some percent of a core."""
    code = "import sys; from anchorsplat.batch import main; sys.exit(main(sys.argv[1:]))"
    words = ["enhance", f"{inputs}/*.ply", "-o", str(out), "--workers", str(workers), "--json", "-q", *options]
    process = subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.PIPE)
    most = [0]
    used = [0.0]

    def watch() -> None:
        while process.poll() is None:
            most[0] = max(most[0], tree_memory(process.pid))
            for _ in range(8):
                used[0] = max(used[0], tree_processor_time(process.pid))
                time.sleep(0.25)

    watcher = threading.Thread(target=watch)
    if watched:
        watcher.start()
    told = json.loads(process.communicate()[0])
    if watched:
        watcher.join()
    rows = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    rows = [row for row in rows if "output" in row]
    if told["failed"] or len(rows) != told["total"]:
        sys.exit(f"not all were made: {told}")
    between = sorted(b["time"] - a["time"] - b["seconds"] for a, b in zip(rows, rows[1:]))  # of one worker
    beside = sorted(row["seconds"] - row["engine_seconds"] for row in rows)
    return {"start": told["start_seconds"], "work": told["seconds"] - told["start_seconds"], "memory": most[0], "used": used[0],
            "beside": beside[len(beside) // 2], "between": between[len(between) // 2], "rows": len((out / "manifest.jsonl").read_bytes()) / len(rows)}  # fmt: skip


def read_manifest(count: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "manifest.jsonl")
        row = {"input": "s3://bucket/scans/" + "x" * 40, "identity": "5000000-" + "e" * 32, "fingerprint": "f" * 16,
               "size": 5000000, "sha256": "a" * 64, "messages": ["m" * 150], "output_size": 1600000,
               "output_sha256": "b" * 64, "state": "done", "pad": "p" * 500}  # fmt: skip
        with open(path, "w") as file:
            for number in range(count):
                file.write(json.dumps({"output": f"scans/{number:09d}.spz", **row}) + "\n")
        before = tree_memory(os.getpid())
        begin = time.perf_counter()
        manifest = Manifest(str(path))
        seconds = time.perf_counter() - begin
        print(f"manifest of {count:,} rows, {path.stat().st_size / 1e6:.0f} MB: read in {seconds:.2f} s, "
              f"{(tree_memory(os.getpid()) - before) / count:.0f} bytes of memory a row")  # fmt: skip
        manifest.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, default=200)
    parser.add_argument("--splat", type=Path, default=EXAMPLE)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--method", default="auto")
    parser.add_argument("--manifest", type=int, metavar="N")
    asked = parser.parse_args()
    if asked.manifest:
        read_manifest(asked.manifest)
        return
    options = ["--method", asked.method]
    loops, ones, twos = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        inputs = Path(folder, "in")
        inputs.mkdir()
        for number in range(asked.splats):
            shutil.copy(asked.splat, inputs / f"{number:05d}.ply")
        few = Path(folder, "few")
        few.mkdir()
        for number in range(2):
            shutil.copy(asked.splat, few / f"{number}.ply")
        idle = batch(few, Path(folder, "few-out"), 2, options, watched=True)["used"]
        some = Path(folder, "some")
        some.mkdir()
        for path in sorted(inputs.iterdir())[:_WATCHED]:
            shutil.copy(path, some)
        memory = [batch(some, Path(folder, f"some-{n}"), n, options, watched=True) for n in (1, 2)]
        for _ in range(asked.repeat):
            for measured, run in (
                (loops, lambda out: loop(inputs, out, options)),
                (ones, lambda out: batch(inputs, out, 1, options)),
                (twos, lambda out: batch(inputs, out, 2, options)),
            ):
                measured.append(run(Path(folder, "out")))
                shutil.rmtree(Path(folder, "out"))
            print(f"loop {loops[-1]:.2f} s; one worker {ones[-1]}; two {twos[-1]}", file=sys.stderr)
    one, two = (min(runs, key=lambda run: run["work"]) for runs in (ones, twos))
    best = min(loops)
    print(f"{asked.splats} splats of {asked.splat.stat().st_size / 1e6:.1f} MB, --method {asked.method}, shortest of {asked.repeat}")
    print(f"shell loop         {best:8.2f} s  {best / asked.splats * 1e3:8.1f} ms each")
    for name, run, watched in (("batch, one worker", one, memory[0]), ("batch, two workers", two, memory[1])):
        print(f"{name:<18} {run['work']:8.2f} s  {run['work'] / asked.splats * 1e3:8.1f} ms each, {best / run['work']:.2f} times the loop, "
              f"start {run['start']:.1f} s, {watched['memory'] / 1e6:.0f} MB")  # fmt: skip
    processor = (memory[1]["used"] - idle) / (min(_WATCHED, asked.splats) - 2)
    print(f"processor time beside the program, of driver, workers and Ray: {processor * 1e3:.1f} ms a splat")
    print(f"overhead of a splat, medians: in the worker beside its program {one['beside'] * 1e3:.1f} ms, "
          f"between two tasks {one['between'] * 1e3:.1f} ms; {one['rows']:.0f} bytes of manifest")  # fmt: skip


if __name__ == "__main__":
    main()
