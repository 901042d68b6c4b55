#!/usr/bin/env python3
"""Where today's list loses most: the figures of docs/reading-table.md that the board does not print.

    scripts/reading-findings.py data/reading.jsonl.gz

Needs NumPy.
"""

import gzip
import json
import sys

import numpy as np


def best(row):
    return max([0] + [gain for methods in row["gains"].values() for gains in methods.values() for gain in gains])


def gain(row):
    return row["list"].get("gain", 0)


def contradicted(row):
    """Recognised or tagged, and treated, but at another pixel than outlines say."""
    today = row["list"]
    return (row["made"] in ("classic", "antialiased") and today.get("looks") in (row["made"], None) and
            today.get("contradictions", 0) > 0 and today["method"] != "none" and today["strength"] > 0 and "low" in today)


def held(rows):
    told = [row for row in rows if row["list"].get("low")]
    return np.mean([row["list"]["low"] <= row["pixel"] <= row["list"]["high"] for row in told])


def say(name, rows, left=None):
    text = f"{name}: {len(rows)} splats gain {np.mean([gain(r) for r in rows]):.2f} of {np.mean([best(r) for r in rows]):.2f} dB"
    print(text + (f", {100 * sum(best(r) - gain(r) for r in rows) / left:.0f} % of what is left to the best" if left else ""))


def main():
    lines = [json.loads(line) for line in gzip.open(sys.argv[1], "rt", encoding="utf-8")][1:]
    rows = [row for row in lines if "gains" in row]
    left = sum(best(row) - gain(row) for row in rows)
    print(f"classic and antialiased: {sum(row['made'] in ('classic', 'antialiased') for row in rows)} splats")

    found = [row for row in rows if contradicted(row)]
    say("contradicted", found, left)
    # An interval is the estimate over and times a factor.
    said = np.array([np.sqrt(row["list"]["low"] * row["list"]["high"]) / row["pixel"] for row in found])
    print(f"  outlines a quarter too large at most: {100 * np.mean(said <= 1.25):.0f} %, more than twice: {100 * np.mean(said > 2):.0f} %")
    say("  land", [row for row in found if "land" in row["kind"]])
    say("  thinned to a fifth", [row for row in found if row["edit"] == "thinned: fifth"])
    say("  floaters", [row for row in found if row["edit"] == "floaters"])
    around = [row for row in rows if row["kind"] in ("photographed", "room", "backdrop")]
    print(f"photographed, room, backdrop: {100 * held(around):.0f} % of the intervals hold the true pixel")

    few = [row for row in rows if "features" in row and not row["tag"] and row["list"].get("looks") is None]
    print("nothing asked, as too few show:", ", ".join(f"{row['id']} {gain(row):.1f}" for row in few))
    for row in sorted(rows, key=gain)[:5]:
        print(f"  worst: {row['id']} {gain(row):.2f}")

    for edit in ("raised: by 2 logits", "enhanced before, one for one"):
        some = [row for row in rows if row["edit"] == edit]
        say(edit, some)
        print(f"  worst {min(map(gain, some)):.1f}, {100 * np.mean([gain(row) < -0.1 for row in some]):.0f} % lose")
    for made in ("filtered", "mip"):
        alone = [row for row in rows if row["made"] == made and row["list"].get("strength") == 0 and "antialiased" in row["gains"]]
        gains = [row["gains"]["antialiased"]["network"][1] for row in alone]  # at 0.35 of the pixel
        print(f"left alone, {made}: {len(alone)}, a network at 0.35 of the pixel drawn as antialiased gives {np.mean(gains):.2f} dB")


if __name__ == "__main__":
    main()
