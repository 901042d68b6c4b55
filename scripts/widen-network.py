#!/usr/bin/env python3
"""Makes a larger compact network of a trained one that computes the same: for a training to go on from.

    scripts/widen-network.py IN.safetensors OUT.safetensors [--rounds R] [--head-hidden G]

New rounds of messages come before the others and add nothing at first; new channels of the head weigh nothing at
first. The rest of their weights is random, so that they can learn (uniform up to 1/√inputs, as torch::nn::Linear
begins). OUT is in single precision. Needs numpy.
"""

import argparse
import re
import sys

import numpy as np

import network_file

EDGE_FEATURES = 18  # kEdgeFeatures in src/model/compact/compact_features.h


def linear(random, outputs, inputs):
    bound = 1 / np.sqrt(inputs)
    return (random.uniform(-bound, bound, (outputs, inputs)).astype("<f4"),
            random.uniform(-bound, bound, outputs).astype("<f4"))


def add_round(values, random):
    """As the first. Its normalisation is that of the embedding, whose own becomes the plain one: of what is normalised
    already, that makes the same."""
    hidden = len(values["embed.norm.weight"])
    for name in reversed([n for n in values if n.startswith("rounds.")]):
        number, rest = re.fullmatch(r"rounds\.(\d+)\.(.*)", name).groups()
        values[f"rounds.{int(number) + 1}.{rest}"] = values.pop(name)
    new = "rounds.0."
    values[new + "own.weight"], values[new + "own.bias"] = linear(random, hidden, hidden)
    values[new + "other.weight"], _ = linear(random, hidden, hidden)
    values[new + "edge.weight"], _ = linear(random, hidden, EDGE_FEATURES)
    values[new + "message.weight"], values[new + "message.bias"] = linear(random, hidden, hidden)
    values[new + "update_first.weight"], values[new + "update_first.bias"] = linear(random, hidden, 3 * hidden)
    values[new + "update_second.weight"] = np.zeros((hidden, hidden), "<f4")
    values[new + "update_second.bias"] = np.zeros(hidden, "<f4")
    values[new + "norm.weight"] = values["embed.norm.weight"]
    values[new + "norm.bias"] = values["embed.norm.bias"]
    values["embed.norm.weight"] = np.ones(hidden, "<f4")
    values["embed.norm.bias"] = np.zeros(hidden, "<f4")


def widen_head(values, wide, random):
    narrow = len(values["head.first.bias"])
    first, first_bias = linear(random, wide, values["head.first.weight"].shape[1])
    first[:narrow], first_bias[:narrow] = values["head.first.weight"], values["head.first.bias"]
    second, second_bias = linear(random, wide, wide)
    second[:narrow, :narrow], second[:narrow, narrow:] = values["head.second.weight"], 0
    second_bias[:narrow] = values["head.second.bias"]
    values.update({"head.first.weight": first, "head.first.bias": first_bias,
                   "head.second.weight": second, "head.second.bias": second_bias})
    for name in values:
        if name.startswith("out.") and name.endswith(".weight"):
            weight = np.zeros((values[name].shape[0], wide), "<f4")
            weight[:, :narrow] = values[name]
            values[name] = weight


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network")
    parser.add_argument("output")
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--head-hidden", type=int)
    parser.add_argument("--seed", type=int, default=7)
    arguments = parser.parse_args()
    metadata, values = network_file.read(arguments.network)
    if metadata.get("format") != "anchorsplat-compact":
        sys.exit(f"{arguments.network}: not a compact network")
    random = np.random.default_rng(arguments.seed)
    rounds, head = int(metadata["option.rounds"]), int(metadata["option.head_hidden"])
    if (arguments.rounds or rounds) < rounds or (arguments.head_hidden or head) < head:
        sys.exit(f"{arguments.network} has {rounds} rounds and {head} channels in its head: neither can become less")
    for _ in range(rounds, arguments.rounds or rounds):
        add_round(values, random)
    if (arguments.head_hidden or head) > head:
        widen_head(values, arguments.head_hidden, random)
    metadata["option.rounds"] = str(arguments.rounds or rounds)
    metadata["option.head_hidden"] = str(arguments.head_hidden or head)
    network_file.write(arguments.output, metadata, values, lambda name: False)


if __name__ == "__main__":
    main()
