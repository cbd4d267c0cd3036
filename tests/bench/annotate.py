"""Beside tests/bench/annotate.sh: demonstrations at other paces, task files of unseen mappings, and baselines.

    annotate.py warp DATASET NEW SEED        every way between two key frames at a pace of its own, 0.5 to 2 times; 10 Hz
    annotate.py mappings TASKS.json OUT N    a task file of N of the mappings that a run of Object Sorting did not train on
    annotate.py unseen | only TASKS.json OTHERS.json    holds, or picks, tasks that were not trained on
    annotate.py table NAME ANNOTATED.json    what was measured, in a line
    annotate.py transfer ACTED.mcap… LABELLED NEW    true calls of `ntp act --record` for what a robot recorded itself
    annotate.py baselines DATASET            gripper events and change points (PELT) against the dataset's own calls
"""

import json
import pathlib
import random
import shutil
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

HZ = 10
TOLERANCES = (0.1, 0.5, 1.0)


def tables(root, folder):
    files = sorted((root / folder).glob("chunk-*/file-*.parquet"))
    return pa.concat_tables([pq.read_table(file) for file in files])


def column(table, name):
    return table.column(name).to_numpy(zero_copy_only=False)


def matrix(table, name):
    return np.array(table.column(name).to_pylist(), dtype=np.float64)


def with_columns(table, **columns):
    for name, values in columns.items():
        name = name.replace("__", "/").replace("_DOT_", ".")
        at = table.schema.get_field_index(name)
        field = table.schema.field(at)
        table = table.set_column(at, field, pa.array(values, type=field.type))
    return table


def write(table, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)


def warp(source, target, seed):
    """Resamples every episode: positions on the line between two frames, the gripper as it was before."""
    source, target = pathlib.Path(source), pathlib.Path(target)
    dice = random.Random(seed)
    frames, calls = tables(source, "data"), tables(source, "ntp/calls")
    episodes, meta = pq.read_table(source / "ntp/episodes.parquet"), tables(source, "meta/episodes")
    of_frames, of_calls = column(frames, "episode_index"), column(calls, "episode_index")
    begin, end = column(calls, "frame_begin").copy(), column(calls, "frame_end").copy()
    rows, lengths = [], []
    for episode in range(len(episodes)):
        at = np.flatnonzero(of_frames == episode)
        part = frames.slice(at[0], len(at))
        secs, keys = column(part, "ntp.time_secs"), np.flatnonzero(column(part, "ntp.boundary"))
        # When each old frame is, at the new paces.
        times = np.zeros(len(at))
        for first, last in zip(keys[:-1], keys[1:]):
            pace = 2.0 ** dice.uniform(-1, 1)
            times[first : last + 1] = times[first] + (secs[first : last + 1] - secs[first]) / pace
        new = np.arange(0, times[-1] + 1e-9, 1 / HZ)
        lower = np.clip(np.searchsorted(times, new, side="right") - 1, 0, len(at) - 1)
        upper = np.minimum(lower + 1, len(at) - 1)
        gap = np.maximum(times[upper] - times[lower], 1e-9)
        share = np.where(upper > lower, (new - times[lower]) / gap, 0.0)[:, None]
        state, gripper = matrix(part, "observation.state"), matrix(part, "ntp.gripper_in_world_m")
        mixed = lambda values: values[lower] + share * (values[upper] - values[lower])
        between = mixed(state)
        between[:, -2:] = state[lower, -2:]
        # A slot that shows another body now has jumped.
        jumps = np.abs(state[upper] - state[lower])[:, :-2].max(axis=1) > 0.15
        between[jumps] = state[lower][jumps]
        gripper = mixed(gripper)
        nearest = lambda frame: int(np.clip(round(times[frame] * HZ), 0, len(new) - 1))
        for call in np.flatnonzero(of_calls == episode):
            begin[call], end[call] = nearest(begin[call]), nearest(end[call] - 1) + 1
        n, first = len(new), sum(lengths)
        moved = np.vstack([gripper[1:] - gripper[:-1], np.zeros((1, 3))])
        closed = np.append(between[1:, -1], between[-1, -1])[:, None]
        boundary = np.zeros(n, dtype=bool)
        boundary[[nearest(key) for key in keys]] = True
        last = np.arange(n) == n - 1
        rows.append(
            with_columns(
                part.take(lower),
                observation_DOT_state=between.astype(np.float32).tolist(),
                action=np.hstack([moved, closed]).astype(np.float32).tolist(),
                timestamp=(np.arange(n) / HZ).astype(np.float32),
                frame_index=np.arange(n),
                index=first + np.arange(n),
                next_DOT_done=last,
                next_DOT_success=last,
                ntp_DOT_time_secs=np.arange(n) / HZ,
                ntp_DOT_boundary=boundary,
                ntp_DOT_recording_frame=np.arange(n),
                ntp_DOT_gripper_in_world_m=gripper.astype(np.float32).tolist(),
            )
        )
        lengths.append(n)
    lengths = np.array(lengths)
    first = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    zeros, path = np.zeros(len(lengths), dtype=np.int64), "chunk-000/file-000.parquet"
    spans = dict(frame_begin=begin, frame_end=end)
    numbers = {"n_frames": lengths, "n_recorded_frames": lengths, "specification_frames": lengths, "n_scopes": zeros}
    places = ["calls__chunk_index", "calls__file_index", "scopes__chunk_index", "scopes__file_index"]
    places = {name: zeros for name in [*places, "scopes_from_index"]}
    write(pa.concat_tables(rows), target / "data" / path)
    write(with_columns(calls, **spans), target / "ntp/calls" / path)
    write(tables(source, "ntp/scopes").slice(0, 0), target / "ntp/scopes" / path)
    write(with_columns(episodes, **numbers, **places), target / "ntp/episodes.parquet")
    names = ["data__chunk_index", "data__file_index", "meta__episodes__chunk_index", "meta__episodes__file_index"]
    bounds = dict(length=lengths, dataset_from_index=first, dataset_to_index=first + lengths)
    write(with_columns(meta, **bounds, **{name: zeros for name in names}), target / "meta/episodes" / path)
    for file in ["meta/tasks.parquet", "meta/subtasks.parquet", "meta/stats.json"]:
        (target / file).write_bytes((source / file).read_bytes())
    info, ntp = (json.loads((source / file).read_text()) for file in ["meta/info.json", "ntp/info.json"])
    info.update(total_frames=int(lengths.sum()), fps=HZ)
    ntp.update(total_scopes=0, frames="all")
    (target / "meta/info.json").write_text(json.dumps(info))
    (target / "ntp/info.json").write_text(json.dumps(ntp))
    print(f"{len(lengths)} episodes, {lengths.sum()} frames (before: {len(frames)})")


def goals(task):
    return tuple(sorted((goal["source"], goal["target"]) for goal in task["goals"]))


def tasks_of(path):
    return json.loads(pathlib.Path(path).read_text())["tasks"]


def trained_on(path):
    return {goals(task) for task in tasks_of(path) if task["split"] == "seen"}


def mappings(tasks, out, n):
    """Unseen mappings as a task file in the authors' form."""
    seen = trained_on(tasks)
    unseen = [task for task in tasks_of(tasks) if task["split"] == "unseen" and goals(task) not in seen]
    chosen = random.Random(0).sample(unseen, int(n))
    names = ["cube", "can", "ball", "brick", "bin_1", "bin_2", "bin_3", "bin_4"]
    name = lambda slot: slot if isinstance(slot, str) else names[slot]
    goal = lambda of: {"name": "pick_release", "src": name(of["source"]), "target": name(of["target"])}
    end = lambda of: {"type": "on_top", "src": name(of["source"]), "target": name(of["target"])}
    listed = [
        {"id": f"other_{at}", "goals": [goal(of) for of in task["goals"]], "end_constraints": [end(of) for of in task["goals"]]}
        for at, task in enumerate(chosen)
    ]
    file = {"name": "unseen mappings", "scene": {"task_objects": names}, "tasks": listed}
    pathlib.Path(out).write_text(json.dumps(file, indent=1))
    print(f"{len(chosen)} of {len(unseen)} unseen mappings")


def unseen(tasks, others):
    """No task of the others was trained on."""
    common = trained_on(tasks) & trained_on(others)
    assert not common, f"trained on: {common}"


def only(tasks, others):
    """Options of `ntp dataset filter` for the others' tasks that were not trained on."""
    seen = trained_on(tasks)
    others = [task for task in tasks_of(others) if task["split"] == "seen" and goals(task) not in seen]
    assert others, "all were trained on"
    print(" ".join(f"--task {task['id']}" for task in others))


def table(name, path):
    told = json.loads(pathlib.Path(path).read_text())
    of = told["measured"]
    levels = [
        f"{level} frames {m['frame_accuracy']:.4f} IoU {m['iou']:.4f} F1 "
        + "/".join(f"{m['boundary_f1'][t]:.4f}" for t in ("0.1", "0.5", "1"))
        + f" edit {m['edit_score']:.4f}"
        for level, m in of["levels"].items()
    ]
    calls = of["calls"]
    print(
        f"{name}: {of['episodes']} episodes, {len(told['doubtful'])} doubtful; calls with program and span "
        f"{of['calls_with_span'] / calls:.4f}, with argument {of['calls_with_argument'] / calls:.4f}, exact "
        f"{of['episodes_exact']}; " + "; ".join(levels)
    )


def acted(path):
    """What `ntp act` recorded of each episode: calls with times, and where the gripper was."""
    from mcap_protobuf.reader import read_protobuf_messages

    episodes = []
    for message in read_protobuf_messages(path, topics=["/ntp/episode/start", "/ntp/call", "/ntp/return", "/tf"]):
        secs, of, topic = message.log_time_ns / 1e9, message.proto_msg, message.topic
        if topic == "/ntp/episode/start":
            episodes.append({"calls": [], "ends": {}, "path": []})
        elif topic == "/ntp/call":
            episodes[-1]["calls"].append((secs, of))
        elif topic == "/ntp/return":
            episodes[-1]["ends"][of.call] = secs
        else:
            place = next(t.translation for t in of.transforms if t.child_frame_id == "gripper")
            episodes[-1]["path"].append((secs, place.x, place.y, place.z))
    return episodes


def offset(episode, secs, gripper):
    """Seconds from the rows' times to those of the other recording, by where the gripper is in both."""
    path = np.array(episode["path"])

    def distance(shift):
        at = np.stack([np.interp(secs + shift, path[:, 0], path[:, axis]) for axis in (1, 2, 3)], axis=1)
        return np.linalg.norm(at - gripper, axis=1).mean()

    shifts = path[0, 0] + np.arange(-1.0, 1.0, 0.01)
    best = min(shifts, key=distance)
    assert distance(best) < 0.02, f"not the same episode: {distance(best)} m apart"
    return best


def transfer(*arguments):
    *recordings, labelled, target = map(pathlib.Path, arguments)
    shutil.copytree(labelled, target)
    episodes = [episode for recording in recordings for episode in acted(recording)]
    frames, calls = tables(labelled, "data"), pq.read_table(labelled / "ntp/calls/chunk-000/file-000.parquet")
    provenance = pq.read_table(labelled / "ntp/episodes.parquet")
    slots = provenance.column("slots").to_pylist()[0]
    of_frames = column(frames, "episode_index")
    assert len(provenance) == len(episodes), f"{len(provenance)} episodes, but {len(episodes)} were acted"
    rows, counts = [], []
    for number, episode in enumerate(episodes):
        at = np.flatnonzero(of_frames == number)
        part = frames.slice(at[0], len(at))
        secs = column(part, "ntp.time_secs")
        shift = offset(episode, secs, matrix(part, "ntp.gripper_in_world_m"))
        nearest = lambda when: int(np.abs(secs + shift - when).argmin())
        for begin, call in episode["calls"]:
            program = type(call).DESCRIPTOR.fields_by_name["program"].enum_type.values_by_number[call.program].name
            program = program.lower().removeprefix("program_")
            root = not call.HasField("caller")
            first, last = (0, len(at) - 1) if root else (nearest(begin), nearest(episode["ends"][call.call]))
            argument = call.argument if call.HasField("argument") else None
            ends = program != "none"
            rows.append(
                dict(
                    episode_index=number, call_id=call.call, caller_id=None if root else call.caller, depth=call.depth,
                    step=call.step, program=program, argument_slot=argument,
                    argument=None if argument is None else slots[argument], input_begin=0, input_end=len(at),
                    output_begin=first if ends else None, output_end=last + 1 if ends else None, frame_begin=first,
                    frame_end=last + 1, end_of_program=call.end_of_program, instruction=None, confidence=1.0,
                )
            )  # fmt: skip
        counts.append(len(episode["calls"]))
    write(pa.Table.from_pylist(rows, schema=calls.schema), target / "ntp/calls/chunk-000/file-000.parquet")
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    numbers = {"n_calls": np.array(counts), "calls_from_index": first}
    write(with_columns(provenance, **numbers), target / "ntp/episodes.parquet")
    print(f"{len(episodes)} episodes, {len(rows)} calls")


def f1(right, found, tolerance):
    matched, at = 0, 0
    for secs in right:
        while at < len(found) and found[at] < secs - tolerance - 1e-6:
            at += 1
        if at < len(found) and found[at] <= secs + tolerance + 1e-6:
            matched, at = matched + 1, at + 1
    return matched


def truths(calls):
    """The frames at which calls of a level begin or end, but for the first."""
    levels = {
        "sub_task": lambda call: call["depth"] == 1,
        "skill": lambda call: call["instruction"] is not None,
        "primitive": lambda call: call["program"] in ("move_to", "grip", "release"),
    }
    for level, is_of in levels.items():
        spans = [(c["frame_begin"], c["frame_end"] - 1) for c in calls if is_of(c) and c["frame_end"] - c["frame_begin"] > 1]
        yield level, sorted({frame for span in spans for frame in span} - {0})


def baselines(root):
    import ruptures

    root = pathlib.Path(root)
    frames, calls = tables(root, "data"), tables(root, "ntp/calls").to_pylist()
    episodes = column(frames, "episode_index")
    by_episode = {}
    for call in calls:
        by_episode.setdefault(call["episode_index"], []).append(call)
    parts = []
    for episode in range(int(episodes.max()) + 1):
        at = np.flatnonzero(episodes == episode)
        part = frames.slice(at[0], len(at))
        state, gripper = matrix(part, "observation.state"), matrix(part, "ntp.gripper_in_world_m")
        last = len(at) - 1
        truth = {level: [f for f in found if f < last] for level, found in truths(by_episode[episode])}
        parts.append((column(part, "ntp.time_secs"), state[:, -1] > 0.5, gripper, truth))
    result = {}
    score = lambda name, found: result.update({name: rates(parts, found)})
    changes = [list(np.flatnonzero(closed[1:] != closed[:-1]) + 1) for _, closed, _, _ in parts]
    opens = [[f for f in frames if not part[1][f]] for frames, part in zip(changes, parts)]
    score("gripper events", changes)
    score("gripper opens", opens)
    best = {}
    for penalty in [0.5, 1, 2, 5, 10, 20, 50, 100, 200]:
        found = []
        for _, closed, gripper, _ in parts:
            signal = np.hstack([gripper, closed[:, None] * 0.2])
            signal = (signal - signal.mean(axis=0)) / (signal.std(axis=0) + 1e-9)
            points = ruptures.Pelt(model="l2", min_size=2, jump=1).fit(signal).predict(pen=penalty)
            found.append([point for point in points if point < len(signal)])
        for level, values in rates(parts, found).items():
            if level not in best or values["0.5"] > best[level]["0.5"]:
                best[level] = values | {"penalty": penalty}
    result["PELT, best penalty for each level"] = best
    print(json.dumps(result, indent=1))


def rates(parts, found):
    rates = {}
    for level in ("sub_task", "skill", "primitive"):
        totals = [0, 0, *([0] * len(TOLERANCES))]
        for (secs, _, _, truth), frames in zip(parts, found):
            right, points = secs[truth[level]], secs[frames] if len(frames) else np.zeros(0)
            totals[0], totals[1] = totals[0] + len(right), totals[1] + len(points)
            for k, tolerance in enumerate(TOLERANCES):
                totals[2 + k] += f1(right, points, tolerance)
        total = totals[0] + totals[1]
        rates[level] = {str(t): round(2 * totals[2 + k] / max(total, 1), 4) for k, t in enumerate(TOLERANCES)}
    return rates


if __name__ == "__main__":
    known = {of.__name__: of for of in (warp, mappings, unseen, only, table, transfer, baselines)}
    known[sys.argv[1]](*sys.argv[2:])
