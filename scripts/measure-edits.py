#!/usr/bin/env python3
"""Edits beside those of splat-transform, planted floaters, and memory: measure-edits.py equal|speed|floaters|memory|python …

    measure-edits.py equal PROGRAM SPLAT_TRANSFORM FOLDER SPLAT…       the same actions: counts, and PSNR of pictures of both
    measure-edits.py speed PROGRAM SPLAT_TRANSFORM FOLDER LARGE.ply CASE…  seconds of both in turn, the middle of three; of all cases
                                                                       where none is named
    measure-edits.py floaters PROGRAM FOLDER SPLAT…                     3 % planted in each: how many are found, what else goes
    measure-edits.py memory PROGRAM FOLDER LARGE.ply                    the most memory of its own
    measure-edits.py python LARGE.ply                                  a chain in Python, whose package PYTHONPATH has: time and memory

FOLDER is for what comes out. SPLAT_TRANSFORM is a command: version 3.7 of the npm package @playcanvas/splat-transform, in Node 22. Needs
NumPy."""

import json
import os
import resource
import statistics
import subprocess
import sys
import time

import numpy

ACTIONS = {
    "translate": ["--translate", "0.3,-0.2,0.1"],
    "rotate": ["--rotate", "20,-35,110"],
    "scale": ["--scale", "1.7"],
    "box": ["--filter-box", "BOX"],
    "sphere": ["--filter-sphere", "SPHERE"],
    "nan": ["--filter-nan"],
    "value": ["--filter-value", "opacity,gt,0.5"],
    "value x": ["--filter-value", "x,gt,MIDDLE"],
    "value rot": ["--filter-value", "rot_0,gt,0.1"],
    "value rest": ["--filter-value", "f_rest_4,gt,0.01"],
    "harmonics": ["--filter-harmonics", "1"],
    "chain": ["--rotate", "10,20,30", "--scale", "0.5", "--translate", "0.1,0,0.2", "--filter-sphere", "HALF"],
}


def rows_of(path):
    """Names of the floats of a binary PLY, its rows, and its header."""
    data = open(path, "rb").read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().splitlines()
    names = [line.split()[2] for line in header if line.startswith("property")]
    count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
    return names, numpy.frombuffer(data, "<f4", count * len(names), end).reshape(count, len(names)), header


def write_rows(path, rows, header):
    with open(path, "wb") as out:
        out.write("\n".join(f"element vertex {len(rows)}" if line.startswith("element vertex") else line for line in header).encode() + b"\n")
        out.write(rows.astype("<f4").tobytes())


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def as_ply(program, folder, splat):
    path = os.path.join(folder, "input.ply")
    run(program, "convert", splat, path, "-w", "-q")
    return path


def places(names, rows):
    """Middle and radius of what is there, along LUF."""
    at = rows[:, [names.index(name) for name in "xyz"]].astype(float) * [-1, -1, 1]
    at = at[numpy.isfinite(at).all(axis=1)]
    middle = numpy.median(at, axis=0)
    return middle, numpy.quantile(numpy.linalg.norm(at - middle, axis=1), 0.98)


def filled(action, middle, radius):
    box = ",".join(f"{x:.6g}" for x in [*(middle - 0.4 * radius), *(middle + 0.5 * radius)])
    sphere = ",".join(f"{x:.6g}" for x in [*middle, 0.6 * radius])
    (sx, sy, sz), (cx, cy, cz) = ((f(numpy.radians([10, 20, 30]))) for f in (numpy.sin, numpy.cos))
    about_x, about_y = [[1, 0, 0], [0, cx, -sx], [0, sx, cx]], [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    turn = numpy.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ about_y @ about_x
    half = ",".join(f"{x:.6g}" for x in [*(0.5 * turn @ middle + [0.1, 0, 0.2]), 0.35 * radius])
    return [word.replace("BOX", box).replace("SPHERE", sphere).replace("HALF", half).replace("MIDDLE", f"{middle[0]:.6g}") for word in action]


def joined(action):
    """--name=value: a value may begin with a minus."""
    words = []
    for word in action:
        if words and not word.startswith("--") and words[-1].startswith("--") and "=" not in words[-1]:
            words[-1] += "=" + word
        else:
            words.append(word)
    return words


def compare(program, a, b):
    return json.loads(run(program, "compare", a, b, "--orbit", "4", "--size", "400x400", "--json"))["mean"]["psnr"]


def equal(program, other, folder, splats):
    ours, theirs = os.path.join(folder, "ours.ply"), os.path.join(folder, "theirs.ply")
    worst = {}
    for splat in splats:
        source = as_ply(program, folder, splat)
        names, rows, _ = rows_of(source)
        middle, radius = places(names, rows)
        cases = {name: ([source], joined(filled(action, middle, radius))) for name, action in ACTIONS.items()}
        cases["merge"] = ([source, "--translate=1,0,0", source, "--scale=0.5"], [])
        if "f_rest_4" not in names:
            del cases["value rest"]
        for name, (inputs, action) in cases.items():
            run(program, "convert", *inputs, *action, ours, "-w", "-q")
            run(other, "-w", "-q", *inputs, *action, theirs)
            counts = len(rows_of(ours)[1]), len(rows_of(theirs)[1])
            psnr = compare(program, ours, theirs)
            print(f"{os.path.basename(splat):34} {name:10} {counts[0]:9,} {counts[1]:9,} {'inf' if psnr is None else f'{psnr:.1f}'} dB", flush=True)
            worst.setdefault(name, []).append((counts[0] == counts[1], float("inf") if psnr is None else psnr))
    for name, results in worst.items():
        print(f"{name:10} counts equal {all(same for same, _ in results)}, worst {min(psnr for _, psnr in results):.1f} dB")


def speed(program, other, folder, source, *chosen):
    names, rows, _ = rows_of(source)
    middle, radius = places(names, rows[:: max(1, len(rows) // 100_000)])
    del rows
    out = os.path.join(folder, "out.ply")
    cases = {name: ([source], joined(filled(action, middle, radius))) for name, action in ACTIONS.items()}
    cases["merge"] = ([source, source], [])
    for name, (inputs, action) in cases.items():
        if chosen and name not in chosen:
            continue
        seconds = {"ours": [], "theirs": []}
        for _ in range(3):
            for who, command in (
                ("ours", [program, "convert", *inputs, *action, out, "-w", "-q", "--yes"]),
                ("theirs", [other, "-w", "-q", *inputs, *action, out]),
            ):
                begin = time.perf_counter()
                run(*command)
                seconds[who].append(time.perf_counter() - begin)
        a, b = (statistics.median(seconds[who]) for who in ("ours", "theirs"))
        print(f"{name:10} {a:7.2f} s {b:7.2f} s, {a / b:.2f} of it", flush=True)


def distances(places, others, chunk=2048):
    """To the nearest of some others, all of them looked at."""
    out = numpy.empty(len(places))
    for begin in range(0, len(places), chunk):
        part = places[begin : begin + chunk, None, :] - others[None, :, :]
        out[begin : begin + chunk] = numpy.sqrt((part * part).sum(axis=2).min(axis=1))
    return out


def planted(names, rows, seed):
    """Rows with 3 % more behind them, half of them 0.05 to 0.3 radii from the nearest Gaussian (of 8,192, all the others
    are looked at before), half of them 1.5 to 10 radii from the middle. Each looks like one of the splat."""
    random = numpy.random.default_rng(seed)
    at = rows[:, [names.index(name) for name in "xyz"]].astype(float)
    middle = numpy.median(at, axis=0)
    radius = numpy.quantile(numpy.linalg.norm(at - middle, axis=1), 0.98)
    count = int(0.03 * len(rows))
    near = []
    some = at[random.permutation(len(at))[:8192]]
    while len(near) < count // 2:
        tried = middle + random.uniform(-1.5 * radius, 1.5 * radius, (1024, 3))
        tried = tried[distances(tried, some) < 0.3 * radius]
        apart = numpy.array([numpy.sqrt(((at - place) ** 2).sum(axis=1).min()) for place in tried])
        near += list(tried[(apart > 0.05 * radius) & (apart < 0.3 * radius)])
    near = numpy.array(near[: count // 2])
    way = random.normal(size=(count - len(near), 3))
    way /= numpy.linalg.norm(way, axis=1)[:, None]
    far = middle + way * radius * 1.5 * (10 / 1.5) ** random.uniform(size=(len(way), 1))
    more = rows[random.integers(0, len(rows), count)].copy()
    more[:, [names.index(name) for name in "xyz"]] = numpy.concatenate([near, far])
    return numpy.concatenate([rows, more]), len(near)


def floaters(program, folder, splats):
    path, out = os.path.join(folder, "planted.ply"), os.path.join(folder, "cleaned.ply")
    for splat in splats:
        names, rows, header = rows_of(as_ply(program, folder, splat))
        rows = rows[numpy.isfinite(rows).all(axis=1)]
        number = names.index("nx")
        both, near = planted(names, rows, 1)
        both = both.copy()
        both[:, number] = numpy.arange(1, len(both) + 1)  # which row it was; a float tells up to 2^24
        write_rows(path, both, header)
        run(program, "convert", path, "--filter-floaters", out, "-w", "-q")
        left = rows_of(out)[1][:, number].astype(int) - 1
        gone = numpy.ones(len(both), bool)
        gone[left] = False
        count = len(rows)
        print(
            f"{os.path.basename(os.path.dirname(splat)) + '/' + os.path.basename(splat):48} {count:8,}: found "
            f"{gone[count:].mean():.3f} (near {gone[count:count + near].mean():.3f}, far {gone[count + near:].mean():.3f}), "
            f"of the rest {100 * gone[:count].mean():.2f} % lost",
            flush=True,
        )


def memory(program, folder, source):
    out = os.path.join(folder, "out.ply")
    for name, action in {"rotate": ["--rotate=1,2,3"], "floaters": ["--filter-floaters"], "sorted": ["--scale=2", "--sort=morton"]}.items():
        process = subprocess.Popen([program, "convert", source, *action, out, "-w", "-q", "--yes", "--max-memory", "1.5G"])
        most = 0
        while process.poll() is None:
            try:
                status = open(f"/proc/{process.pid}/status").read()
                most = max(most, next(int(line.split()[1]) for line in status.splitlines() if line.startswith("RssAnon")))
            except (StopIteration, OSError):
                pass
            time.sleep(0.02)
        print(f"{name:10} {most / 1e6:.2f} GB of its own, exit code {process.returncode}", flush=True)


def python(source):
    import anchorsplat

    cloud = anchorsplat.read(source)
    before = next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmRSS"))
    chain = anchorsplat.edit(cloud).translate((1, 0, 0)).rotate((10, 20, 30)).scale(2)
    begin = time.perf_counter()
    made, _ = chain.filter_value("opacity", "gt", 0.5).filter_harmonics(1).apply()
    seconds = time.perf_counter() - begin
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"{seconds:.2f} s; {cloud.nbytes / 1e6:.0f} MB became {made.nbytes / 1e6:.0f} MB, and {(most - before) / 1e3:.0f} MB came on top")


what, *words = sys.argv[1:]
if what == "equal":
    equal(words[0], words[1], words[2], words[3:])
elif what == "speed":
    speed(*words)
elif what == "floaters":
    floaters(words[0], words[1], words[2:])
elif what == "memory":
    memory(*words)
elif what == "python":
    python(*words)
else:
    raise SystemExit(__doc__)
