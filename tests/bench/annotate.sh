#!/usr/bin/env bash
# Measures `ntp annotate` on tasks that its models were not trained on: annotate.sh WORK_DIR
# Three families, at ends of primitives; Block Stacking and Object Sorting at 10 Hz, as recorded and at other paces; and
# recordings made in MuJoCo. Needs Python 3.10 or later; installs pyarrow, ruptures and MuJoCo. A quarter of an hour.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/../foreign/common.sh"
work=$(work_folder "$1")
cd "$here/../.."
environment annotate-venv pyarrow numpy ruptures mujoco mcap mcap-ros2-support mcap-protobuf-support
python="$bin/python $here/annotate.py"

# A model of each family, unless it is there.
train() { # NAME FAMILY TRAIN TRIALS STEPS FURTHER…
    [ -d "$work/$1/models" ] && ls "$work/$1"/models/*/manifest.json > /dev/null 2>&1 && return
    cat > "$work/$1.toml" <<TOML
name = "$1"
seed = 1
[tasks]
family = "$2"
train = $3
unseen = 24
[generate]
trials_per_task = $4
$6
frames = "boundaries"
[[models]]
variant = "ntp"
seeds = [0]
[models.training]
steps = $5
$7
TOML
    ntp run "$work/$1.toml" --out "$work/$1" --to train > "$work/$1.txt" 2>&1
}

# Demonstrations of other tasks: of another seed, or of a task file.
truth() { # NAME FAMILY TRAIN TRIALS FRAMES FURTHER
    [ -f "$work/$1/dataset/manifest.json" ] && return
    cat > "$work/$1.toml" <<TOML
name = "$1"
seed = 90210
[tasks]
$2
train = $3
unseen = 1
[generate]
trials_per_task = $4
$6
[convert]
frames = "$5"
TOML
    ntp run "$work/$1.toml" --out "$work/$1" --to convert > "$work/$1.txt" 2>&1
}

annotate() { # NAME TRUTH MODEL FURTHER…
    rm -rf "$work/$1"
    local name=$1 truth=$2 model=$3
    shift 3
    ntp annotate "$truth" --model "$model" --to "$work/$name" --against "$truth" --json "$@" > "$work/$name.json"
    $python table "$name" "$work/$name.json"
}

train stacking block_stacking 40 20 800 "" ""
train sorting object_sorting 4 250 3000 "counts = { min = 1, max = 5 }" $'scatter_bystanders = 0.5\nmerge_containers = 0.8'
train cleanup table_cleanup 40 25 1500 "counts = { min = 1, max = 4 }" ""

stacking=$(ls -d "$work"/stacking/models/ntp-*) sorting=$(ls -d "$work"/sorting/models/ntp-*)
cleanup=$(ls -d "$work"/cleanup/models/ntp-*)

truth stacking-others 'family = "block_stacking"' 100 2 boundaries ""
$python unseen "$work/stacking/tasks/tasks.json" "$work/stacking-others/tasks/tasks.json"
$python mappings "$work/sorting/tasks/tasks.json" "$work/mappings.json" 24
truth sorting-others $'family = "object_sorting"\nimport = "'"$work"$'/mappings.json"' 23 5 boundaries "counts = { min = 1, max = 3 }"
$python unseen "$work/sorting/tasks/tasks.json" "$work/sorting-others/tasks/tasks.json"
truth cleanup-all 'family = "table_cleanup"' 40 5 boundaries "counts = { min = 1, max = 4 }"
rm -rf "$work/cleanup-others"
ntp dataset filter "$work/cleanup-all/dataset" --to "$work/cleanup-others" \
    $($python only "$work/cleanup/tasks/tasks.json" "$work/cleanup-all/tasks/tasks.json") > /dev/null

annotate boundary-stacking "$work/stacking-others/dataset" "$stacking"
annotate boundary-sorting "$work/sorting-others/dataset" "$sorting"
annotate boundary-cleanup "$work/cleanup-others" "$cleanup"

truth stacking-dense 'family = "block_stacking"' 100 2 all ""
truth sorting-dense $'family = "object_sorting"\nimport = "'"$work"$'/mappings.json"' 23 5 all "counts = { min = 1, max = 3 }"
truth cleanup-dense-all 'family = "table_cleanup"' 40 5 all "counts = { min = 1, max = 4 }"
rm -rf "$work/cleanup-dense"
ntp dataset filter "$work/cleanup-dense-all/dataset" --to "$work/cleanup-dense" \
    $($python only "$work/cleanup/tasks/tasks.json" "$work/cleanup-dense-all/tasks/tasks.json") > /dev/null
for family in stacking sorting cleanup; do
    dense="$work/$family-dense"
    [ -d "$dense/dataset" ] && dense="$dense/dataset"
    annotate "dense-$family" "$dense" "${!family}"
    rm -rf "$work/$family-warped"
    $python warp "$dense" "$work/$family-warped" 7
    annotate "warped-$family" "$work/$family-warped" "${!family}"
    $python baselines "$work/$family-warped" > "$work/baselines-$family.json"
    cat "$work/baselines-$family.json"
done

# Made in MuJoCo by an expert that is not ours: its own ways, contacts and paces, recorded in ROS 2 form and taken in. What
# was called when is known from the other end of the line.
if [ ! -f "$work/mujoco-acted/rollouts.parquet" ]; then
    rm -rf "$work/mujoco-acted"
    ntp act oracle --demonstration "$work/stacking-others/recordings" --episode "$(seq -s, 0 2 47)" --reset \
        --robot "$bin/python data/robots/mujoco_table.py --record $work/mujoco.mcap" --record "$work/mujoco-acted" \
        --json > "$work/mujoco-acted.json" 2> "$work/mujoco-acted.txt" || true
fi
cat > "$work/mujoco-map.toml" <<'TOML'
fps = 10
robot_type = "mujoco"
task = "build the towers"
[episodes]
by = "gap"
topic = "/tf"
secs = 0.5
[observations]
family = "block_stacking"
gripper = { topic = "/tf", field = "transforms[child_frame_id=gripper].transform.translation" }
opening = { topic = "/joint_states", field = "position", joints = ["left", "right"] }
closed_below_m = 0.06
objects = { topic = "/tf", field = "transforms[child_frame_id={}].transform.translation" }
TOML
rm -rf "$work/mujoco-taken" "$work/mujoco-plain" "$work/mujoco-truth"
ntp ingest "$work/mujoco.mcap" --map "$work/mujoco-map.toml" --to "$work/mujoco-taken" > "$work/mujoco-taken.txt"
ntp annotate "$work/mujoco-taken" --model "$stacking" --to "$work/mujoco-plain" --json > "$work/mujoco-plain.json"
$python transfer "$work"/mujoco-acted/recordings/*.mcap "$work/mujoco-plain" "$work/mujoco-truth"
rm -rf "$work/mujoco-labelled"
ntp annotate "$work/mujoco-taken" --model "$stacking" --to "$work/mujoco-labelled" --against "$work/mujoco-truth" \
    --json > "$work/mujoco-labelled.json"
$python table mujoco-stacking "$work/mujoco-labelled.json"
$python baselines "$work/mujoco-truth" > "$work/baselines-mujoco.json"
cat "$work/baselines-mujoco.json"
