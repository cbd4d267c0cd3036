"""Writes our stacking or sorting tasks as a task file of the paper's authors' form, at full size.

Usage: python tests/bench/authors.py RUN_DIR/tasks/tasks.json OUT.json
A pipeline takes the file as `tasks.import`; the first `tasks.train` of its tasks are trained on, the rest are unseen.
"""

import json
import sys

GOALS = {"block_stacking": "pick_place", "object_sorting": "pick_release"}


def main(source: str, to: str) -> None:
    with open(source, encoding="utf-8") as file:
        ours = json.load(file)
    objects: list[str] = []
    for task in ours["tasks"]:
        for goal in task["goals"]:
            objects += [name for name in (goal["source"], goal["target"]) if name not in objects]
    # Slots are categories before containers, each kind in the order of its names.
    containers = {goal["target"] for task in ours["tasks"] for goal in task["goals"]}
    is_container = ours["family"] == "object_sorting"
    objects.sort(key=lambda name: (is_container and name in containers, name))
    tasks = []
    for task in ours["tasks"]:
        pairs = [{"src": goal["source"], "target": goal["target"]} for goal in task["goals"]]
        ends = [
            {"src": end.get("upper", end.get("category")), "target": end.get("lower", end.get("container"))}
            for end in task["conditions"]
        ]
        tasks.append(
            {
                "id": task["id"],
                "goals": [{"name": GOALS[ours["family"]], **pair} for pair in pairs],
                "end_constraints": [{"type": "on_top", **end} for end in ends],
            }
        )
    with open(to, "w", encoding="utf-8") as file:
        json.dump({"scene": {"task_objects": objects}, "tasks": tasks}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
