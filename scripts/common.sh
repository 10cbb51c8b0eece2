# Sourced by the scripts beside it: where things are, how to say things, and which CUDA toolkit to build
# with.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

BUILD_DIR=${CRT_BUILD_DIR:-build/release}
CUDA_CACHE=.cache/cuda
PYTHON_CACHE=.cache/python
JOBS=${CRT_JOBS:-$(nproc)}

say() { printf '== %s\n' "$*"; }
fail() { printf '== error: %s\n' "$*" >&2; exit 1; }

# True if $1 is a CUDA toolkit that is new enough for crt. Debian 12's nvcc, 11.8, is too old.
cuda_is_usable() {
    [ -x "$1/bin/nvcc" ] || return 1
    local major
    major=$("$1/bin/nvcc" --version 2>/dev/null | sed -n 's/.*release \([0-9]*\)\..*/\1/p')
    [ "${major:-0}" -ge 12 ]
}

# Prints the root of the CUDA toolkit to build with: the system's, or the one that scripts/setup fetched.
# Fails when there is none.
# CRT_IGNORE_SYSTEM_CUDA=1 leaves the system's aside, to try the other way on a machine that has one.
find_cuda() {
    local root nvcc
    if [ "${CRT_IGNORE_SYSTEM_CUDA:-0}" != 1 ]; then
        nvcc=$(command -v nvcc || true)
        for root in "${CUDA_HOME:-}" "${CUDA_PATH:-}" \
            "${nvcc:+$(dirname "$(dirname "$(readlink -f "$nvcc")")")}" /usr/local/cuda; do
            if [ -n "$root" ] && cuda_is_usable "$root"; then
                echo "$root"
                return 0
            fi
        done
    fi
    cuda_is_usable "$CUDA_CACHE/toolkit" && readlink -f "$CUDA_CACHE/toolkit"
}

# True if scripts/setup has made an environment of Python with all modules of the package and its tests.
python_is_usable() {
    local modules='nanobind, numpy, pytest, tqdm, yaml, jinja2, nbclient, ipykernel, matplotlib, distributed'
    "$PYTHON_CACHE/bin/python3" -c "import $modules" 2>/dev/null
}

# Installs those of the packages given that are not installed.
install_packages() {
    local missing=() package
    for package in "$@"; do
        # "ii": installed; a package that was removed but not purged is known too.
        case $(dpkg-query -W -f='${db:Status-Abbrev}' "$package" 2>/dev/null || true) in
            ii*) ;;
            *) missing+=("$package") ;;
        esac
    done
    [ ${#missing[@]} -eq 0 ] && return 0

    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null ||
            fail "these packages are missing, and this is neither root nor is there sudo:" \
                "apt-get install ${missing[*]}"
        as_root=(sudo)
    fi
    say "installing ${missing[*]}"
    "${as_root[@]}" apt-get update -q
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -q -y --no-install-recommends "${missing[@]}"
}
