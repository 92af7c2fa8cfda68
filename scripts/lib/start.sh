# To be sourced by the commands in scripts/.

scripts=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

is_usable() { [ -x "$scripts/../.venv/bin/python3" ] && [ -e "$scripts/../catkin_ws/devel/setup.sh" ]; }

asks_for_help() {
  local word
  for word in "$@"; do
    case $word in -h | --help) return 0 ;; esac
  done
  return 1
}

# start "SETUP OPTIONS" COMMAND [WORD...]: sets up what is missing, then becomes the command. Whatever that starts ends
# with it. Help is given without any set-up: by an older build, or by the interpreter of the system.
start() {
  local options=$1; shift
  if asks_for_help "$@"; then
    is_usable || exec_help_of "$@"
  else
    setpriv --pdeathsig TERM "$scripts/setup" --quiet $options
  fi
  . "$scripts/env"
  [ "$1" = python3 ] || set -- python3 "$scripts/lib/own_network.py" "$@"  # our own Python enters it by itself
  exec python3 "$scripts/lib/supervise.py" "$@"
}

exec_help_of() {
  if [ "$1" = python3 ] && command -v python3 >/dev/null; then exec "$@"; fi
  echo "Nothing is set up yet. scripts/setup does it (see scripts/setup --help); then this command lists its options."
  exit 0
}
