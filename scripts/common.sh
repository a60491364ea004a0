# Sourced by the scripts: where we are, who may do what, and what the machine needs.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"

say() { printf '\n\033[1m== %s\033[0m\n' "$*"; }

# as_root COMMAND...: fails without a word if there is neither root nor sudo that asks nothing.
as_root() {
  if [[ $(id -u) == 0 ]]; then "$@"; elif command -v sudo >/dev/null; then sudo "$@"; else return 126; fi
}

# install_packages [FILE...]: those that the files list, by default scripts/packages.txt.
install_packages() {
  local wanted missing=()
  mapfile -t wanted < <(grep -hv '^#' "${@:-scripts/packages.txt}")
  for package in "${wanted[@]}"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
  done
  ((${#missing[@]} == 0)) && return
  say "Installing ${#missing[@]} Debian packages"
  local list="apt-get install -y --no-install-recommends ${missing[*]}"
  as_root true || { echo "This needs root. As root, run:  $list" >&2; exit 1; }
  as_root apt-get update -q
  as_root env DEBIAN_FRONTEND=noninteractive $list
}

# build PRESET [TARGET...]
build() {
  local preset=$1; shift
  say "Building ($preset)"
  cmake --preset "$preset" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >/dev/null
  cmake --build --preset "$preset" ${1:+--target "$@"}
}

bus_is_ready() { "$root/scripts/ready-bus" --check; }
