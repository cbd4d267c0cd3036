#!/usr/bin/env bash
# Lets a run's model act unseen tasks in MuJoCo, a world that is not ours: robots.sh RUN_DIR WORK_DIR [EPISODES [SORTING_RUN_DIR]]
# The model learned from our simulation alone. Needs Python 3.10 or later; installs MuJoCo (200 MB). One line a robot.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source "$here/common.sh"
run=$(cd "$1" && pwd)
work=$(work_folder "$2")
episodes=${3:-20}
cd "$here/../.."
environment robots-venv mujoco mcap mcap-ros2-support
robots=$PWD/data/robots

every=$(seq -s, 0 $((episodes - 1)))

# demonstrations FAMILY TASKS TRIALS COUNTS RUN: of other tasks than the run's, by another seed; holds that none was
# trained on. Sets $family, $model and $shown.
demonstrations() {
    family=$1
    shown="$work/others-$family/recordings"
    model=$(ls -d "$5"/models/ntp-* | head -n 1)
    cat > "$work/others-$family.toml" <<TOML
name = "others"
seed = 90210
[tasks]
family = "$family"
train = $2
unseen = 1
[generate]
trials_per_task = $3
$4
TOML
    ntp run "$work/others-$family.toml" --out "$work/others-$family" --to generate > "$work/others-$family.txt" 2>&1
    "$bin/python" "$here/robots_unseen.py" "$5/tasks/tasks.json" "$work/others-$family/tasks/tasks.json"
}

# act NAME ROBOT: one line, and the failures' causes; a failed trial is a result.
act() {
    rm -rf "$work/$1"
    ntp act "$model" --demonstration "$shown" --episode "$every" --robot "$2" --reset \
        --record "$work/$1" --json > "$work/$1.json" 2> "$work/$1.txt" || true
    "$bin/python" "$here/robots_measured.py" "$1" "$work/$1.json"
    ntp validate "$work/$1" > /dev/null
}

demonstrations block_stacking "$episodes" 1 "" "$run"
ntp act oracle --demonstration "$shown" --robot "$bin/python $robots/template.py" --reset
act simulation "${program[*]} robot --family block_stacking"
act gripper "$bin/python $robots/mujoco_table.py --record $work/gripper.mcap"
act gripper-3mm "$bin/python $robots/mujoco_table.py --noise-mm 3"
act sawyer "$bin/python $robots/mujoco_table.py --robot sawyer --record $work/sawyer.mcap"
"$bin/python" "$here/robots_recorded.py" "$work/gripper.mcap" "$work/sawyer.mcap"

[ -n "${4:-}" ] || exit 0
# Mappings of categories to containers that the run was not trained on, 12 objects.
demonstrations object_sorting 4 $(((episodes + 3) / 4)) "counts = { min = 3, max = 3 }" "$(cd "$4" && pwd)"
act sorting-gripper "$bin/python $robots/mujoco_table.py"
