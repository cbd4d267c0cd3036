#!/usr/bin/env bash
# Lets a run's model act unseen tasks in MuJoCo, a world that is not ours: robots.sh RUN_DIR WORK_DIR [EPISODES]
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
ntp() { cargo run --quiet --release -- "$@"; }

# Demonstrations of other tasks than the run's: another seed. The check below holds that none was trained on.
cat > "$work/others.toml" <<TOML
name = "others"
seed = 90210
[tasks]
family = "block_stacking"
train = $episodes
unseen = 1
[generate]
trials_per_task = 1
TOML
ntp run "$work/others.toml" --out "$work/others" --to generate > "$work/others.txt" 2>&1
"$bin/python" "$here/robots_unseen.py" "$run/tasks/tasks.json" "$work/others/tasks/tasks.json"
every=$(seq -s, 0 $((episodes - 1)))
model=$(ls -d "$run"/models/ntp-* | head -n 1)

# act NAME ROBOT: one line, and the failures' causes; a failed trial is a result.
act() {
    rm -rf "$work/$1"
    ntp act "$model" --demonstration "$work/others/recordings" --episode "$every" --robot "$2" --reset \
        --record "$work/$1" --json > "$work/$1.json" 2> "$work/$1.txt" || true
    "$bin/python" "$here/robots_measured.py" "$1" "$work/$1.json"
    ntp validate "$work/$1" > /dev/null
}

ntp act oracle --demonstration "$work/others/recordings" --robot "$bin/python $robots/template.py" --reset
act simulation "cargo run --quiet --release -- robot --family block_stacking"
act gripper "$bin/python $robots/mujoco_table.py --record $work/gripper.mcap"
act gripper-3mm "$bin/python $robots/mujoco_table.py --noise-mm 3"
act sawyer "$bin/python $robots/mujoco_table.py --robot sawyer --record $work/sawyer.mcap"
"$bin/python" "$here/robots_recorded.py" "$work/gripper.mcap" "$work/sawyer.mcap"
