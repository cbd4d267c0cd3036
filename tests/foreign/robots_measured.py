"""One line of what `ntp act --json` says: robots_measured.py NAME FILE"""

import collections
import json
import math
import sys

name, path = sys.argv[1:3]
said = json.load(open(path))
trials = said["trials"]
n, won = len(trials), said["succeeded"]
assert n, "no trial was acted"
# Wilson's interval, 95 %.
z, p = 1.959964, won / n
middle, half = (
    (p + z * z / (2 * n)) / (1 + z * z / n),
    z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n),
)
causes = collections.Counter(trial["outcome"] for trial in trials if trial["outcome"] != "success")
diverged = sum(trial["first_divergence"] is not None for trial in trials)
print(
    f"{name}: {won} of {n} succeeded ({p:.3f}, {middle - half:.3f} to {middle + half:.3f}); {diverged} diverged;"
    f" failures: {dict(causes) or 'none'}; lost: {said['lost'] or 'no'}"
)
