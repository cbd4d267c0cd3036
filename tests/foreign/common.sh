# What the scripts of this folder share; each sources it.

# Where the Python environment of this name is, or would be.
environment_folder() { echo "${XDG_CACHE_HOME:-$HOME/.cache}/ntp/$1"; }

# Makes a Python environment of this name with these packages, unless it is there: environment NAME PACKAGE…
# Its programs are then in $bin.
environment() {
    local folder
    folder=$(environment_folder "$1")
    shift
    bin="$folder/bin"
    if [ ! -x "$bin/python" ]; then "${PYTHON:-python3}" -m venv "$folder"; fi
    "$bin/pip" install --quiet --disable-pip-version-check "$@"
}

# The folder, made if it is not there, by its whole path.
work_folder() {
    mkdir -p "$1"
    (cd "$1" && pwd)
}

# The program: that of $NTP, or that of this checkout.
program=(${NTP:-cargo run --quiet --release --})
ntp() { "${program[@]}" "$@"; }
