# Sourced by the scripts: the project's directory, root or sudo, and the packages that a script needs.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"

say() { printf '\n\033[1m== %s\033[0m  (%s)\n' "$*" "$(minutes_and_seconds $SECONDS)"; }

# Since the script began, or of as many seconds.
minutes_and_seconds() { printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); }

# spend STAGE SECONDS adds to what print_spent tells: where the minutes went.
declare -A spent
spend() { spent[$1]=$((${spent[$1]:-0} + $2)); }
print_spent() {
  local stage text=''
  for stage in packages configuring building testing; do text+="$stage $(minutes_and_seconds "${spent[$stage]:-0}"), "; done
  echo "${text}in all $(minutes_and_seconds $SECONDS); load $(cut -d' ' -f1-3 /proc/loadavg)"
}

# progress WHAT LOG COMMAND...: runs COMMAND with its output in LOG, and shows one line: WHAT, the last "[n/m]" of the output,
# and for how long. On a terminal the line is written over each second, elsewhere a new one comes each half minute. If the
# command fails, shows its output and ends the script.
progress() {
  local what=$1 log=$2; shift 2
  mkdir -p "$(dirname "$log")"
  "$@" 2>&1 | tee "$log" | show_progress "$what" || { echo; grep -v '^\[[0-9]*/[0-9]*\]' "$log" | tail -n 200; exit 1; } >&2
}
show_progress() {
  local begin=$SECONDS next=$SECONDS line count='' end=$'\n' period=30
  [[ -t 1 ]] && end=$'\r' period=1
  while true; do
    if read -r -t 1 line; then
      [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] && count=" ${BASH_REMATCH[1]} of ${BASH_REMATCH[2]}"
    else
      (($? > 128)) || break  # more than 128: nothing came for a second
    fi
    ((SECONDS < next)) && continue
    next=$((SECONDS + period))
    printf '%s%s, %s   %s' "$what" "$count" "$(minutes_and_seconds $((SECONDS - begin)))" "$end"
  done
  printf '%s%s, %s   \n' "$what" "$count" "$(minutes_and_seconds $((SECONDS - begin)))"
}

# as_root COMMAND...: fails without a word if there is neither root nor sudo that asks nothing.
as_root() {
  if [[ $(id -u) == 0 ]]; then "$@"; elif command -v sudo >/dev/null; then sudo "$@"; else return 126; fi
}

# missing_packages [NAME...]: those of scripts/packages.txt and of scripts/packages-NAME.txt that this machine lacks, a line each.
missing_packages() {
  local package present files=("${@/#/scripts/packages-}")
  # Installed, or provided by one that is, as npm by other packagers' nodejs.
  present=" $(dpkg-query -W -f '${db:Status-Status} ${Package} ${Provides}\n' | sed -n 's/ ([^)]*)//g; s/,//g; s/^installed //p' | tr '\n' ' ') "
  for package in $(sed -s '/^#/d' scripts/packages.txt "${files[@]/%/.txt}" | sort -u); do
    [[ $present == *" $package "* ]] || echo "$package"
  done
}
# Who begins again at once waits for an installation that a broken build has left behind.
install=(apt-get -o DPkg::Lock::Timeout=600 install -y --no-install-recommends) listed=''
# install_packages [NAME...]: installs them.
install_packages() {
  local missing begin=$SECONDS
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} == 0)) && return
  say "Installing ${#missing[@]} Debian packages"
  as_root true || { echo "This needs root. As root, run:  ${install[*]} ${missing[*]}" >&2; exit 1; }
  progress "fetching the list of packages" build/apt.log as_root apt-get update -q
  listed=yes
  progress "installing" build/apt.log as_root env DEBIAN_FRONTEND=noninteractive "${install[@]}" "${missing[@]}"
  spend packages $((SECONDS - begin))
}

# install_meanwhile [NAME...]: the same, while other work goes on. await_packages waits for them.
meanwhile=''
install_meanwhile() {
  local missing
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]} == 0)) && return
  say "Installing ${#missing[@]} more meanwhile"
  as_root true || { install_packages "$@"; return; }
  mkdir -p build
  { [[ $listed ]] || as_root apt-get update -q
    as_root env DEBIAN_FRONTEND=noninteractive "${install[@]}" "${missing[@]}"; } >build/apt-meanwhile.log 2>&1 & meanwhile=$!
}
await_packages() {
  local begin=$SECONDS
  [[ $meanwhile ]] || return 0
  progress "installing" /dev/null tail --pid "$meanwhile" -n +1 -f build/apt-meanwhile.log
  wait "$meanwhile" || { tail -n 50 build/apt-meanwhile.log >&2; exit 1; }
  meanwhile=''
  spend packages $((SECONDS - begin))
}

# What a test reads MCAP files with, as the lock file names it with its digests, into build/mcap_core. Where it cannot be
# had, that test is skipped.
install_node_packages() {
  local from=tests/export/mcap_core to=build/mcap_core begin=$SECONDS
  cmp -s "$from/package-lock.json" "$to/installed" && return
  command -v npm >/dev/null || { echo "There is no npm, so two tests are skipped; scripts/test asan installs it"; return; }
  say "Installing @mcap/core by npm"
  mkdir -p "$to"
  cp "$from/package.json" "$from/package-lock.json" "$from/read.mjs" "$to"
  if (cd "$to" && timeout 60 npm ci --ignore-scripts --no-audit --no-fund --fetch-retries 1 >npm.log 2>&1); then
    cp "$from/package-lock.json" "$to/installed"
  else
    echo "npm could not install it ($to/npm.log), so two tests are skipped"
  fi
  spend packages $((SECONDS - begin))
}

# build PRESET [-DOPTION...] [TARGET...]
build() {
  local preset=$1 options=() targets=() begin=$SECONDS; shift
  for argument; do if [[ $argument == -D* ]]; then options+=("$argument"); else targets+=("$argument"); fi; done
  say "Building ($preset)"
  progress "configuring" "build/$preset/configure.log" cmake --preset "$preset" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON "${options[@]}"
  spend configuring $((SECONDS - begin)); begin=$SECONDS
  progress "building" "build/$preset/build.log" cmake --build --preset "$preset" ${targets[0]:+--target "${targets[@]}"}
  spend building $((SECONDS - begin))
}

# For a build of the programs alone.
programs_only=(-DFOREREACH_TESTS=OFF -DFOREREACH_PYTHON=OFF -DFOREREACH_FLEET=OFF)

# source_into DIRECTORY: the last commit; without git, the tree.
source_into() { mkdir -p "$1" && { git archive HEAD 2>/dev/null || tar -c --exclude=./build --exclude=./run .; } | tar -x -C "$1"; }

bus_is_ready() { "$root/scripts/ready-bus" --check; }
