"""Holds that no task of the second file asks for what a training task of the first asks for: robots_unseen.py A B"""

import json
import sys


def goals(path):
    """The conditions of each training task, whatever their order."""
    tasks = json.load(open(path))["tasks"]
    return [
        frozenset(json.dumps(c, sort_keys=True) for c in task["conditions"])
        for task in tasks
        if task["split"] == "seen"
    ]


trained, shown = map(goals, sys.argv[1:3])
both = set(trained) & set(shown)
assert trained and shown and not both, f"{len(both)} of {len(shown)} tasks were trained on"
print(f"tasks: {len(shown)} shown, none among the {len(trained)} that were trained on")
