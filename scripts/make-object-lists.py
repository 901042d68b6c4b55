#!/usr/bin/env python3
"""Makes the lists of objects in data/ from the furniture libraries of Debian's package sweethome3d-furniture and the
AC3D models of flightgear-data-ai (scripts/fetch-objects.sh gets both).

    scripts/make-object-lists.py --program build/lean/anchorsplat --objects OBJECTS_DIR --out data

The rules, which never look at a result:

* usable: 300 to 50,000 visible triangles, and a texture or at least three colours.
* variants: objects of one library and creator whose names differ only in numbers, colours, materials and sizes, or that
  share their name's first word and are listed under the same title; any two of one library with a picture in common
  (sets of furniture, people in the same clothes); and any two of nearly equal shape (D2 distribution within 0.06, box
  within 2 %). They stand in one group, and a group is never in two splits.
* some objects are always for training: the project's examples and those it was developed with.
* test-30, then validation: textured objects without missing pictures, one of a group, in turn from each category in
  alphabetical order; within a category first those whose creator, then whose library has been taken least often,
  then in the order of SHA-256(seed, address).
* train: every other usable object whose group is in neither.
* domain-10: AC3D aircraft, the largest model of each folder, with 1,000 to 50,000 visible triangles, a texture and no
  missing picture; in turn from each kind of aircraft (KINDS below), in the same order.
"""

import argparse
import csv
import hashlib
import json
import pathlib
import re
import subprocess
import sys

SEED = "anchorsplat 1"
LIBRARIES = ["BlendSwap-CC-0", "BlendSwap-CC-BY", "KatorLegaz", "Reallusion", "Scopia"]
LIBRARY_FOLDER = "usr/share/sweethome3d/furniture"
AIRCRAFT_FOLDER = "usr/share/games/flightgear/AI/Aircraft"
ALWAYS_TRAIN = {
    "BlendSwap-CC-0.sh3f#" + key
    for key in ["barrel", "cupcake", "hotDog", "childHut", "cartoon_biplane", "stoneLantern"]
}
TEST, VALIDATION, DOMAIN = 30, 20, 10
MINOR_WORDS = set(
    "a b c d l r s m xl whites white black beige blue brown green grey gray red yellow orange pink purple burgundy dark "
    "light silver gold golden copper wood wooden oak pear alder metal metallic glass leather plastic textured small big "
    "large little mini high low short tall long wide left right open opened closed close upper lower double single "
    "seats seat rect round square rounded regular with without and folded v".split())

KINDS = {
    "balloon": "balloon",
    "glider or ultralight": "centrair-101 cri-cri flash2a FK9MK2",
    "light propeller": "Cub Dragonfly Ferry c172 c177 c182 c182rg c310 c310u3a pa-28 DR400 Fokker-S-11 DH82 ercoupe "
                       "Cessna337 Dromader G-164 Diamond-Da42 Beechcraft-Staggerwing Arup-S2 Cessna208Caravan "
                       "Cessna-421-Golden-Eagle",
    "historic fighter": "Spitfire bf109 A6M2 seahawk Polikarpov-I16",
    "jet fighter": "f16 f-14b F-18 F-4 JA37 Jaguar-GR1 Lightning MiG-21bis Mirage2000 eurofighter T-38 Buccaneer F-15",
    "bomber or reconnaissance": "vulcanb2 SR-71 E-2C",
    "business jet": "BAe-125 Citation-Bravo Embraer-Legacy Bombardier-Challenger",
    "airliner": "",
    "spacecraft or fancy": "SpaceShuttle bluebird",
}


def fail(message):
    sys.exit(f"make-object-lists.py: {message}")


def info(program, address):
    run = subprocess.run([program, "info", "--json", "--quiet", address], capture_output=True, text=True)
    if run.returncode != 0:
        return {"error": run.stderr.strip().split("\n")[-1]}
    return json.loads(run.stdout)


def order(address):
    return hashlib.sha256(f"{SEED}\n{address}".encode()).hexdigest()


def words(key):
    """Of "bigSofa_red-02": the words that say what it is."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", key)
    kept = [p.lower() for p in parts if not p.isdigit() and p.lower() not in MINOR_WORDS]
    return tuple(kept) or tuple(p.lower() for p in parts)


def title(name):
    kept = [w for w in re.findall(r"[a-z]+", name.lower()) if w not in MINOR_WORDS]
    return " ".join(kept) or name.lower()


def box(item):
    sides = [high - low for low, high in zip(item["bounds"]["min"], item["bounds"]["max"])]
    return [side / max(sides) for side in sides]


def same_shape(a, b):
    return (max(abs(x - y) for x, y in zip(a["box"], b["box"])) < 0.02
            and sum(abs(x - y) for x, y in zip(a["shape"], b["shape"])) < 0.06)


def why_not(item):
    if "error" in item:
        return "unreadable"
    if item["triangles"] < 300:
        return "fewer than 300 triangles"
    if item["triangles"] > 50000:
        return "more than 50,000 triangles"
    if item["textures"] == 0 and item["colours"] < 3:
        return "no texture and fewer than 3 colours"
    return ""


def group_variants(items):
    """Gives each item the address of the first of its group."""
    parent = list(range(len(items)))

    def root(i):
        while parent[i] != i:
            i = parent[i]
        return i

    for i, a in enumerate(items):
        for j in range(i):
            b = items[j]
            named = (a["library"], a["creator"]) == (b["library"], b["creator"]) and (
                a["words"] == b["words"] or (a["words"][0] == b["words"][0] and title(a["name"]) == title(b["name"])))
            painted = a["library"] == b["library"] and not a["painting"].isdisjoint(b["painting"])
            if named or painted or same_shape(a, b):
                low, high = sorted((root(i), root(j)))
                parent[high] = low
    for i, item in enumerate(items):
        item["group"] = items[root(i)]["address"]


def draw(items, count, kind):
    """One item in turn of each kind, until there are `count`; never two of one group."""
    taken, groups, creators, libraries = [], set(), {}, {}
    kinds = sorted({item[kind] for item in items})
    while len(taken) < count:
        before = len(taken)
        for name in kinds:
            left = [i for i in items if i[kind] == name and i["group"] not in groups]
            if not left or len(taken) == count:
                continue
            best = min(left, key=lambda i: (creators.get(i["creator"], 0), libraries.get(i["library"], 0),
                                            order(i["address"])))
            creators[best["creator"]] = creators.get(best["creator"], 0) + 1
            libraries[best["library"]] = libraries.get(best["library"], 0) + 1
            groups.add(best["group"])
            taken.append(best)
        if len(taken) == before:
            fail(f"only {before} of {count} objects fulfil the rule")
    return taken


def has_missing_picture(item):
    return any("picture" in warning for warning in item["warnings"])


def furniture(program, folder):
    items = []
    for library in LIBRARIES:
        path = folder / LIBRARY_FOLDER / f"{library}.sh3f"
        found = info(program, str(path))
        if "objects" not in found:
            fail(f"{path}: {found.get('error', 'no library')}")
        for item in found["objects"]:
            item["library"] = library
            item["address"] = f"{library}.sh3f#{item['key']}"
            item["why_not"] = why_not(item)
            items.append(item)
    usable = [item for item in items if not item["why_not"]]
    for item in usable:
        item["words"], item["box"] = words(item["key"]), box(item)
        item["painting"] = {picture["crc32"] for picture in item["pictures"]}
    group_variants(usable)
    missing = ALWAYS_TRAIN - {item["address"] for item in usable}
    if missing:
        fail(f"not among the usable objects: {sorted(missing)}")
    taken = {item["group"] for item in usable if item["address"] in ALWAYS_TRAIN}
    fit = [i for i in usable if i["textures"] > 0 and not has_missing_picture(i) and i["group"] not in taken]
    for split, count in [("test-30", TEST), ("validation", VALIDATION)]:
        drawn = draw(fit, count, "category")
        for item in drawn:
            item["split"] = split
        taken |= {item["group"] for item in drawn}
        fit = [item for item in fit if item["group"] not in taken]
    held = {item["group"] for item in usable if "split" in item}
    for item in usable:
        if "split" not in item:
            item["split"] = "variant" if item["group"] in held else "train"
    return items


def aircraft(program, folder):
    kind_of = {name: kind for kind, names in KINDS.items() for name in names.split()}
    items = []
    for path in sorted((folder / AIRCRAFT_FOLDER).rglob("*.ac")):
        # Wheels, propellers and liveries of one aircraft lie in one folder: the largest model is the aircraft.
        item = info(program, str(path))
        relative = path.relative_to(folder)
        item.update(address=str(relative), group=relative.parts[6], library="flightgear-data-ai", key=path.stem,
                    name=relative.parts[6], creator="FlightGear", licence="GPL-2.0-or-later",
                    category=kind_of.get(relative.parts[6], "airliner"))
        items.append(item)
    return items


def write_list(path, title_line, items):
    lines = [f"# {title_line}", "# Made by scripts/make-object-lists.py; docs/dataset.md says how to use it."]
    path.write_text("\n".join(lines + [item["address"] for item in items]) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="anchorsplat")
    parser.add_argument("--objects", required=True, type=pathlib.Path, help="where scripts/fetch-objects.sh put them")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    arguments = parser.parse_args()

    items = furniture(arguments.program, arguments.objects)
    planes = aircraft(arguments.program, arguments.objects)
    fit = [p for p in planes if "error" not in p and 1000 <= p["triangles"] <= 50000 and p["textures"] > 0
           and not has_missing_picture(p)]
    for plane in fit:  # the largest of each folder
        plane["largest"] = plane["triangles"] == max(p["triangles"] for p in fit if p["group"] == plane["group"])
    drawn = draw([p for p in fit if p["largest"]], DOMAIN, "category")
    columns = ["object", "name", "category", "creator", "licence", "triangles", "textures", "colours", "split",
               "variant_of"]
    with open(arguments.out / "objects.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for item in items:
            variant = item.get("group", "")
            writer.writerow([
                item["address"], item["name"], item["category"], item["creator"], item["licence"],
                item.get("triangles", ""), item.get("textures", ""), item.get("colours", ""),
                item["why_not"] or item["split"], "" if variant == item["address"] else variant])
        for plane in drawn:
            writer.writerow([
                plane["address"], plane["name"], plane["category"], plane["creator"], plane["licence"],
                plane["triangles"], plane["textures"], plane["colours"], f"domain-{DOMAIN}", ""])
    for split, what in [("train", "Objects for training"), ("validation", "Objects for choosing between settings"),
                        ("test-30", "Objects no training may ever see")]:
        write_list(arguments.out / f"{split}.txt", f"{what}: library#object of sweethome3d-furniture.",
                   [item for item in items if item.get("split") == split])
    write_list(arguments.out / "domain-10.txt", "Objects of another world, for tests only: files of flightgear-data-ai.",
               drawn)
    for split in ["train", "validation", "test-30", "variant"]:
        print(split, sum(item.get("split") == split for item in items))
    print("usable", sum(not item["why_not"] for item in items), "of", len(items))
    print("aircraft that fit", len({p["group"] for p in fit}), "of", len({p["group"] for p in planes}))


if __name__ == "__main__":
    main()
